# The first commands of a user, with `maquette` in the PATH: first_minute.sh MEDIA OUT
set -e
media=$1 out=$2
maquette densepose "$media/photo.jpg" --out "$out" --overlay
maquette densepose "$media/clip.mp4" --out "$out" --overlay
maquette head "$media/photo.jpg" --out "$out/head.glb" --preview "$out/head.png" --seconds 0
maquette edges "image:$media/box_depth.png?depth_unit=0.001&fx=600" --out "$out" --boxes --overlay
