// Which model bundle is used when none is named.
#pragma once

#include <string>

// The environment variable MAQ_BUNDLE, else the bundle installed (or staged) with this program; "" without either.
std::string default_bundle();
// The same for edges: MAQ_EDGES_BUNDLE, heads: MAQ_HEADS_BUNDLE, prediction: MAQ_PREDICTION_BUNDLE, and scenes:
// MAQ_SCENE_BUNDLE.
std::string default_edges_bundle();
std::string default_heads_bundle();
std::string default_prediction_bundle();
std::string default_scene_bundle();
