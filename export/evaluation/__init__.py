"""How well dense pose works: tables of figures on labelled images, pictures on real photographs."""
