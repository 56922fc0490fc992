"""Scenes from posed photos and a point cloud: the networks of NPBG++, their training and export."""
