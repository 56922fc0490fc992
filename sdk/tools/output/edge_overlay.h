// The picture of a field of edges: depth in colours, shaded, with the sharp pixels drawn by kind.
#pragma once

#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>

// BGR. Small fields are enlarged by a whole number. Near is red, far is blue, unknown is black; creases are yellow,
// boundaries white, 1.5 r to either side.
cv::Mat draw_edge_overlay(const maquette::EdgesResult& result);
