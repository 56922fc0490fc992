// Turns the graph of an ONNX file into layers.
#pragma once

#include <string>

#include "nn/portable/network.h"
#include "nn/portable/onnx_model.h"

namespace maq {

// Values between QuantizeLinear and DequantizeLinear stay quantized, and images have their channels last, so that most
// transpositions are only names. Throws MAQ_ERROR_UNSUPPORTED for a graph with other operators or in another order than
// the networks of dense pose have. `name` names the file in errors.
NetworkPlan build_network(const OnnxModel& model, const std::string& name);

}  // namespace maq
