// Which model bundle is used when none is named.
#pragma once

#include <string>
#include <vector>

// The networks of a system: the folder of the installed bundle, and the variable that names another folder.
struct SystemNetworks {
  const char* system;  // as in `pip install 'maquette[densepose]'`
  const char* bundle;
  const char* variable;
};

inline constexpr SystemNetworks kDenseposeNetworks{"densepose", "densepose-b-int8", "MAQ_BUNDLE"};
inline constexpr SystemNetworks kScenesNetworks{"scenes", "scenes-int8", "MAQ_SCENE_BUNDLE"};
inline constexpr SystemNetworks kEdgesNetworks{"edges", "edges-int8", "MAQ_EDGES_BUNDLE"};
inline constexpr SystemNetworks kHeadsNetworks{"heads", "heads-int8", "MAQ_HEADS_BUNDLE"};
inline constexpr SystemNetworks kPredictionNetworks{"prediction", "prediction-int8", "MAQ_PREDICTION_BUNDLE"};
inline constexpr SystemNetworks kBodyNetworks{"body", "body", "MAQ_BODY_BUNDLE"};

// The systems of this build.
std::vector<SystemNetworks> networks_of_build();

// Returns the folder that the variable names, else the bundle installed (or staged) with this program; "" without
// either.
std::string default_bundle(const SystemNetworks& networks);

// Returns `given`, or for "" the default bundle. Throws where there is none: what is missing, where it was looked for,
// and how to get it.
std::string bundle_or_default(const SystemNetworks& networks, const std::string& given);

// Sentences about networks without a default bundle.
std::string missing_networks(const SystemNetworks& networks);
std::string advice_on_missing(const SystemNetworks& networks);
