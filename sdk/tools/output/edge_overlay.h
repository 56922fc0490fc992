// The image of a field of edges: depth in colours, shaded, with sharp pixels, curves and boxes drawn over it.
#pragma once

#include <maquette/maquette.hpp>
#include <vector>

#include "output/canvas.h"

// Small fields are enlarged by a whole number. Near is red, far is blue, unknown is black. Where the field is
// under 1.5 r it is tinted, yellow for creases and white for boundaries; so are the lines of `curves`, of which concave
// creases are green, with a dot at each corner. Each of `boxes` has its outline, and on it the three lengths in
// millimetres.
Canvas draw_edge_overlay(const maquette::EdgesResult& result, const std::vector<maq_edges_curve>& curves,
                         const std::vector<maq_edges_corner>& corners, const std::vector<maq_edges_box>& boxes);
