"""Results of Maquette for other packages, which are imported when they are needed: `supervision`, `rerun`, and the
colours of `detectron2`."""
