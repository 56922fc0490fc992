"""How well dense pose works: tables of metrics on labelled images, images on real photographs."""
