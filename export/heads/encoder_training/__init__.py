"""Images of made heads drawn, cropped and learnt from on one graphics processor, without files of images."""
