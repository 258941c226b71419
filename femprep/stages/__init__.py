"""Stages that labels and anyone's surfaces share: between the surfaces of a heart and its judged mesh."""
