"""What is near, what is inside, what crosses: trees, closest points, exact predicates, intersections."""
