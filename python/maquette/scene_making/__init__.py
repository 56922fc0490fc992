"""From a film or photos to a scene: `maquette.make_scene`."""
