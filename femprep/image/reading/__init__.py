"""Label maps and images from files: NIfTI, NRRD, MetaImage, DICOM SEG, Slicer segments, masks."""
