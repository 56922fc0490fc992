#include "nn/portable/network_builder.h"

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include "core/error.h"
#include "nn/portable/convolution.h"
#include "nn/portable/float_stage.h"
#include "nn/portable/matrix_product.h"
#include "nn/portable/value_layers.h"

namespace maq {
namespace {

// A value of the graph.
struct Value {
  int tensor = -1;
  bool is_float = false;
  Quantization quantization;     // of a tensor that is not of floats
  bool is_channels_last = true;  // the order of the graph's axes; memory has channels last in any case
  // For constants: the numbers, and if they are quantized, the scales, one or one for each output channel.
  const OnnxTensor* constant = nullptr;
  std::vector<float> scales;
  // For a result that waits for its quantization: writes it and returns its tensor.
  std::function<int(const Quantization&)> write_quantized;
  // For a result of floats: limits it, adds a bias to it.
  std::function<void(const FloatRange&)> limit;
  std::function<void(const std::vector<float>&)> add_bias;
  std::string shape_of;  // of the result of Shape
};

class Builder {
 public:
  Builder(const OnnxModel& model, const std::string& name) : model_(model), name_(name) {}

  NetworkPlan build() {
    for (const OnnxNode& node : model_.nodes) {
      for (const std::string& input : node.inputs) ++uses_[input];
    }
    for (const auto& [constant_name, constant] : model_.constants) values_[constant_name].constant = &constant;
    for (const OnnxValueInfo& input : model_.inputs) add_input(input);
    for (const OnnxNode& node : model_.nodes) add(node);
    for (const OnnxValueInfo& output : model_.outputs) plan_.outputs.push_back(float_tensor(value(output.name)));
    check_order();
    return std::move(plan_);
  }

 private:
  using Handler = void (Builder::*)(const OnnxNode&, Value&);

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(MAQ_ERROR_UNSUPPORTED, name_, " cannot run without ONNX Runtime: ", what, ".");
  }

  void add(const OnnxNode& node) {
    static const std::map<std::string, Handler> handlers = {
        {"Add", &Builder::add_sum},
        {"Clip", &Builder::add_limits},
        {"Concat", &Builder::add_concatenation},
        {"Constant", &Builder::add_constant},
        {"Conv", &Builder::add_convolution},
        {"DequantizeLinear", &Builder::add_dequantization},
        {"Flatten", &Builder::add_flatten},
        {"Gemm", &Builder::add_matrix_product},
        {"GlobalAveragePool", &Builder::add_mean},
        {"MatMul", &Builder::add_matrix_product},
        {"MaxPool", &Builder::add_subsampling},
        {"Mul", &Builder::add_scaling},
        {"QuantizeLinear", &Builder::add_quantization},
        {"Relu", &Builder::add_limits},
        {"Reshape", &Builder::add_reshape},
        {"Shape", &Builder::add_shape},
        {"Transpose", &Builder::add_transposition},
    };
    const auto handler = handlers.find(node.type);
    if (handler == handlers.end()) fail("it has the operator " + node.type);
    Value made;
    (this->*handler->second)(node, made);
    values_[node.outputs[0]] = std::move(made);
  }

  // --- values ---

  Value& value(const std::string& of) {
    const auto found = values_.find(of);
    if (found == values_.end()) fail("nothing computes " + of);
    return found->second;
  }
  Value& input(const OnnxNode& node, size_t index) {
    if (index >= node.inputs.size()) fail("an operator " + node.type + " has too few inputs");
    return value(node.inputs[index]);
  }
  const OnnxTensor& constant(const OnnxNode& node, size_t index) {
    const Value& of = input(node, index);
    if (of.constant == nullptr) fail("an operator " + node.type + " has a computed parameter");
    return *of.constant;
  }
  float number(const OnnxNode& node, size_t index) {
    const OnnxTensor& of = constant(node, index);
    if (of.size() < 1) fail("an operator " + node.type + " has an empty parameter");
    return float(of.number(0));
  }
  template <class To>
  static std::vector<To> numbers(const OnnxTensor& of) {
    std::vector<To> all(of.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = To(of.number(i));
    return all;
  }

  int new_tensor(bool is_float) {
    plan_.is_float.push_back(is_float);
    return int(plan_.is_float.size()) - 1;
  }
  int add_step(std::unique_ptr<Layer> layer, std::vector<int> inputs, bool writes_floats) {
    const int output = new_tensor(writes_floats);
    plan_.steps.push_back({std::move(layer), std::move(inputs), output});
    return output;
  }

  // A tensor of quantized values.
  int quantized_tensor(const Value& of) const {
    if (of.tensor < 0 || of.is_float) fail("values are not quantized where they should be");
    return of.tensor;
  }
  int float_tensor(const Value& of) {
    if (of.tensor < 0) fail("a result is used before it is quantized");
    if (of.is_float) return of.tensor;
    return add_step(std::make_unique<Dequantize>(of.quantization.scale), {of.tensor}, true);
  }

  void add_input(const OnnxValueInfo& input) {
    Value& made = values_[input.name];
    made.is_float = true;
    made.tensor = new_tensor(true);
    plan_.inputs.push_back(made.tensor);
    // Inputs with their channels last are transposed before they are used.
    made.is_channels_last = std::any_of(model_.nodes.begin(), model_.nodes.end(), [&](const OnnxNode& node) {
      return node.type == "Transpose" && node.inputs[0] == input.name;
    });
    if (!made.is_channels_last) made.tensor = add_step(std::make_unique<ChannelsLast>(), {made.tensor}, true);
  }

  // --- operators ---

  void add_constant(const OnnxNode& node, Value& made) {
    const auto found = node.attributes.find("value");
    if (found == node.attributes.end()) fail("a constant has no value");
    made.constant = &found->second.tensor;
  }

  Quantization quantization(const OnnxNode& node) {
    const Quantization read{number(node, 1), int(number(node, 2))};
    if (!(read.scale >= 0) || read.zero_point < 0 || read.zero_point > 255) fail("a quantization is not of 8 bits");
    return read;
  }

  void add_dequantization(const OnnxNode& node, Value& made) {
    const Value& from = input(node, 0);
    if (from.constant != nullptr) {
      made.constant = from.constant;
      made.scales = numbers<float>(constant(node, 1));
      if (node.inputs.size() > 2) {
        const std::vector<float> zeros = numbers<float>(constant(node, 2));
        if (std::any_of(zeros.begin(), zeros.end(), [](float zero) { return zero != 0; })) {
          fail("weights have a zero point");
        }
      }
      return;
    }
    made.tensor = quantized_tensor(from);
    made.is_channels_last = from.is_channels_last;
    made.quantization = quantization(node);
    if (made.quantization.zero_point != from.quantization.zero_point) fail("a zero point changes");
  }

  void add_quantization(const OnnxNode& node, Value& made) {
    const Value& from = input(node, 0);
    if (from.constant != nullptr) {  // dequantized next, with the same scale
      made.constant = from.constant;
      return;
    }
    made.quantization = quantization(node);
    made.is_channels_last = from.is_channels_last;
    if (from.write_quantized) {
      made.tensor = from.write_quantized(made.quantization);
    } else if (from.is_float) {
      made.tensor = add_quantization_of_floats(float_tensor(from), made.quantization);
    } else if (from.quantization.scale == made.quantization.scale &&
               from.quantization.zero_point == made.quantization.zero_point) {
      made.tensor = quantized_tensor(from);
    } else {
      made.tensor =
          add_step(std::make_unique<Requantize>(from.quantization, made.quantization), {quantized_tensor(from)}, false);
    }
  }

  // Takes the layers of floats before along.
  int add_quantization_of_floats(int tensor, const Quantization& to) {
    std::vector<std::unique_ptr<FloatLayer>> layers;
    while (!plan_.steps.empty() && plan_.steps.back().output == tensor) {
      Step& step = plan_.steps.back();
      auto* const layer = dynamic_cast<FloatLayer*>(step.layer.get());
      if (layer == nullptr) break;
      layers.emplace(layers.begin(), layer);
      (void)step.layer.release();
      tensor = step.inputs[0];
      plan_.steps.pop_back();
    }
    if (layers.empty()) return add_step(std::make_unique<Quantize>(to), {tensor}, false);
    if (layers.back()->output_channels() % 8 != 0) {
      fail("floats are quantized that have a number of channels that 8 does not divide");
    }
    return add_step(std::make_unique<FloatStage>(std::move(layers), to), {tensor}, false);
  }

  // Throws unless each step reads what a step before it writes.
  void check_order() const {
    std::vector<bool> is_written(plan_.is_float.size(), false);
    for (const int tensor : plan_.inputs) is_written[size_t(tensor)] = true;
    for (const Step& step : plan_.steps) {
      for (const int tensor : step.inputs) {
        if (!is_written[size_t(tensor)]) fail("a value of floats is used before and after its quantization");
      }
      is_written[size_t(step.output)] = true;
    }
    for (const int tensor : plan_.outputs) {
      if (!is_written[size_t(tensor)]) fail("an output is used as a value within");
    }
  }

  Windows windows(const OnnxNode& node, int rows, int columns) const {
    const std::vector<int64_t> strides = node.integers("strides", {1, 1});
    const std::vector<int64_t> dilations = node.integers("dilations", {1, 1});
    const std::vector<int64_t> pads = node.integers("pads", {0, 0, 0, 0});
    if (strides.size() != 2 || strides[0] != strides[1] || dilations.size() != 2 || dilations[0] != dilations[1] ||
        pads.size() != 4 || strides[0] < 1 || dilations[0] < 1) {
      fail("a convolution has unequal strides or dilations");
    }
    return {rows, columns, int(strides[0]), int(dilations[0]), int(pads[0]), int(pads[1]), int(pads[2]), int(pads[3])};
  }

  void add_convolution(const OnnxNode& node, Value& made) {
    const Value& image = input(node, 0);
    const Value& kernel = input(node, 1);
    const OnnxTensor& weights = constant(node, 1);
    if (image.is_channels_last || weights.dims.size() != 4) fail("a convolution is not of images");
    const int outputs = int(weights.dims[0]), inputs = int(weights.dims[1]);
    const Windows where = windows(node, int(weights.dims[2]), int(weights.dims[3]));
    const bool is_depthwise = node.integer("group", 1) == outputs && inputs == 1 && outputs > 1;
    if (!is_depthwise && node.integer("group", 1) != 1) fail("a convolution has groups");
    made.is_channels_last = false;
    if (kernel.scales.empty()) {
      const std::vector<float> bias = node.inputs.size() > 2 ? numbers<float>(constant(node, 2)) : std::vector<float>();
      made.is_float = true;
      if (is_depthwise) {
        if (outputs % 4 != 0) fail("a convolution has a number of channels that 4 does not divide");
        add_float_layer(std::make_unique<FloatDepthwise>(where, outputs, numbers<float>(weights), bias), image, made);
      } else {
        add_float_layer(std::make_unique<FloatConvolution>(where, inputs, outputs, numbers<float>(weights), bias),
                        image, made);
      }
      return;
    }
    if ((is_depthwise ? outputs % 8 : inputs % 2) != 0) {
      fail("a convolution has a number of channels that does not fill vectors");
    }
    const int tensor = quantized_tensor(image);
    const std::vector<int32_t> bias =
        node.inputs.size() > 2 ? numbers<int32_t>(constant(node, 2)) : std::vector<int32_t>();
    made.write_quantized = [=, &weights, scales = kernel.scales,
                            from = image.quantization](const Quantization& to) -> int {
      std::vector<float> of_sums(static_cast<size_t>(outputs));
      for (size_t i = 0; i < of_sums.size(); ++i) {
        of_sums[i] = from.scale * scales[scales.size() == 1 ? 0 : i] / to.scale;
      }
      const std::vector<int8_t> values = numbers<int8_t>(weights);
      std::unique_ptr<Layer> layer;
      if (is_depthwise) {
        layer = std::make_unique<QuantizedDepthwise>(where, outputs, values, bias, of_sums, to);
      } else {
        layer = std::make_unique<QuantizedConvolution>(where, inputs, outputs, values, bias, of_sums, to);
      }
      return add_step(std::move(layer), {tensor}, false);
    };
  }

  template <class FloatLayer>
  void add_float_layer(std::unique_ptr<FloatLayer> layer, const Value& image, Value& made) {
    made.limit = [layer = layer.get()](const FloatRange& range) { layer->set_range(range); };
    made.tensor = add_step(std::move(layer), {float_tensor(image)}, true);
  }

  void add_matrix_product(const OnnxNode& node, Value& made) {
    const Value& image = input(node, 0);
    const OnnxTensor& weights = constant(node, 1);
    if (!image.is_channels_last || weights.dims.size() != 2 || node.integer("transA", 0) != 0) {
      fail("a matrix product is not of channels");
    }
    const bool is_transposed = node.integer("transB", 0) == 1;
    const size_t outputs = size_t(weights.dims[is_transposed ? 0 : 1]);
    const size_t inputs = size_t(weights.dims[is_transposed ? 1 : 0]);
    std::vector<float> values = numbers<float>(weights);
    if (!is_transposed) {
      const std::vector<float> from = values;
      for (size_t i = 0; i < inputs; ++i) {
        for (size_t o = 0; o < outputs; ++o) values[o * inputs + i] = from[i * outputs + o];
      }
    }
    const std::vector<float> bias = node.inputs.size() > 2 ? numbers<float>(constant(node, 2)) : std::vector<float>();
    auto layer = std::make_unique<MatrixProduct>(inputs, outputs, values, bias);
    made.is_float = true;
    if (bias.empty()) made.add_bias = [layer = layer.get()](const std::vector<float>& of) { layer->set_bias(of); };
    made.tensor = add_step(std::move(layer), {float_tensor(image)}, true);
  }

  void add_sum(const OnnxNode& node, Value& made) {
    const bool is_swapped = input(node, 0).constant != nullptr;
    const Value &a = input(node, is_swapped ? 1 : 0), &b = input(node, is_swapped ? 0 : 1);
    if (b.constant != nullptr) {
      const std::vector<float> bias = numbers<float>(*b.constant);
      if (!a.add_bias || uses_[node.inputs[is_swapped ? 1 : 0]] != 1) fail("a constant is added to a shared value");
      a.add_bias(bias);
      made = a;
      made.add_bias = nullptr;
      return;
    }
    if (a.is_channels_last != b.is_channels_last) fail("values of different orders are added");
    made.is_channels_last = a.is_channels_last;
    if (a.is_float || b.is_float) {
      auto layer = std::make_unique<FloatSum>();
      made.is_float = true;
      made.limit = [layer = layer.get()](const FloatRange& range) { layer->set_range(range); };
      const std::vector<int> tensors = {float_tensor(a), float_tensor(b)};
      made.tensor = add_step(std::move(layer), tensors, true);
      return;
    }
    made.write_quantized = [this, tensors = std::vector<int>{quantized_tensor(a), quantized_tensor(b)},
                            of_a = a.quantization, of_b = b.quantization](const Quantization& to) {
      return add_step(std::make_unique<QuantizedSum>(of_a, of_b, to), tensors, false);
    };
  }

  void add_mean(const OnnxNode& node, Value& made) {
    const Value& from = input(node, 0);
    if (from.is_channels_last) fail("a mean is not of images");
    made.is_channels_last = false;
    made.write_quantized = [this, tensor = quantized_tensor(from), of = from.quantization](const Quantization& to) {
      return add_step(std::make_unique<QuantizedMean>(of, to), {tensor}, false);
    };
  }

  // Limits belong to the layer before.
  void add_limits(const OnnxNode& node, Value& made) {
    const Value& from = input(node, 0);
    if (!from.limit || uses_[node.inputs[0]] != 1) fail("a shared value is limited");
    FloatRange range;
    range.lowest = node.type == "Relu" ? 0 : number(node, 1);
    if (node.type == "Clip") range.highest = number(node, 2);
    from.limit(range);
    made = from;
    made.limit = nullptr;
  }

  void add_scaling(const OnnxNode& node, Value& made) {
    const Value& from = input(node, 0);
    made = from;
    made.tensor = quantized_tensor(from);
    made.quantization.scale *= number(node, 1);
  }

  void add_subsampling(const OnnxNode& node, Value& made) {
    const Value& from = input(node, 0);
    const Windows where = windows(node, 1, 1);
    if (from.is_channels_last || node.integers("kernel_shape", {}) != std::vector<int64_t>{1, 1}) {
      fail("the greatest value of several is chosen");
    }
    made = from;
    made.tensor = add_step(std::make_unique<Subsample>(where.stride), {quantized_tensor(from)}, false);
  }

  void add_concatenation(const OnnxNode& node, Value& made) {
    const Value& first = input(node, 0);
    std::vector<int> tensors;
    for (size_t i = 0; i < node.inputs.size(); ++i) {
      const Value& part = input(node, i);
      if (part.is_channels_last != first.is_channels_last || part.is_float != first.is_float ||
          part.quantization.scale != first.quantization.scale ||
          part.quantization.zero_point != first.quantization.zero_point || part.tensor < 0) {
        fail("values of different kinds are concatenated");
      }
      tensors.push_back(part.tensor);
    }
    int64_t axis = node.integer("axis", 0);
    if (axis < 0) axis += 4;
    constexpr int64_t kPlaceOfAxis[] = {0, 3, 1, 2};  // where channels are first in the graph's order
    if (axis < 0 || axis > 3) fail("tensors of more than four axes are concatenated");
    if (!first.is_channels_last) axis = kPlaceOfAxis[axis];
    made = first;
    made.tensor = add_step(std::make_unique<Concatenation>(size_t(axis)), tensors, first.is_float);
  }

  void add_reshape(const OnnxNode& node, Value& made) {
    const Value& from = input(node, 0);
    const Value& shape = input(node, 1);
    if (!from.is_channels_last || from.tensor < 0) fail("an image with its channels first is reshaped");
    made = from;
    std::vector<int> tensors = {from.tensor};
    std::vector<int64_t> extents;
    if (shape.constant != nullptr) {
      extents = numbers<int64_t>(*shape.constant);
    } else {
      tensors.push_back(value(shape.shape_of).tensor);
    }
    made.tensor = add_step(std::make_unique<Reshape>(extents), tensors, from.is_float);
  }

  void add_shape(const OnnxNode& node, Value& made) {
    if (!input(node, 0).is_channels_last) fail("the shape of an image with its channels first is used");
    made.shape_of = node.inputs[0];
  }

  void add_flatten(const OnnxNode& node, Value& made) {
    const Value& from = input(node, 0);
    if (!from.is_channels_last) fail("an image with its channels first is flattened");
    made.is_float = true;
    made.tensor = add_step(std::make_unique<Reshape>(std::vector<int64_t>{0, 1, 1, -1}), {float_tensor(from)}, true);
  }

  void add_transposition(const OnnxNode& node, Value& made) {
    const Value& from = input(node, 0);
    const std::vector<int64_t> order = node.integers("perm", {});
    const bool to_last = order == std::vector<int64_t>{0, 2, 3, 1};
    if ((!to_last && order != std::vector<int64_t>{0, 3, 1, 2}) || from.is_channels_last == to_last) {
      fail("axes are transposed in another way than channels");
    }
    made = from;
    made.limit = nullptr;
    made.add_bias = nullptr;
    made.is_channels_last = to_last;
  }

  const OnnxModel& model_;
  const std::string& name_;
  NetworkPlan plan_;
  std::map<std::string, Value> values_;
  std::map<std::string, int> uses_;
};

}  // namespace

NetworkPlan build_network(const OnnxModel& model, const std::string& name) { return Builder(model, name).build(); }

}  // namespace maq
