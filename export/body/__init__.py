"""The body data of a bundle: mesh, skeleton, shapes, keypoints, surface and pose prior of the MakeHuman body."""
