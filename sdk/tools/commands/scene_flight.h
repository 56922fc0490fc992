// Cameras for a clip of a scene.
#pragma once

#include <maquette/scene.h>

#include <vector>

// `frames` cameras that walk smoothly through `stops`, which have one size, in their order. Needs one stop at least.
std::vector<maq_pinhole_camera> flight_through(const std::vector<maq_pinhole_camera>& stops, int frames);

// `frames` cameras on a circle around the scene's box, a little above it, that look at its middle; 60 degrees wide.
std::vector<maq_pinhole_camera> flight_around(const maq_scene_info& scene, int width_px, int height_px, int frames);

// The same camera with another image size; it shows at least the previous view.
maq_pinhole_camera with_size(const maq_pinhole_camera& camera, int width_px, int height_px);
