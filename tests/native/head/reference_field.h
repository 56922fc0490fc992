// A head's field network in float64, written as its formulas are, with derivatives by a tape: what the engine is
// compared with.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "head/field/field_engine.h"

namespace reference_field {

using maq::head::FieldShape;
using maq::head::FieldWeights;

// A number that remembers from what it was computed.
class Tape {
 public:
  struct Node {
    int a, b;  // -1: none
    double by_a, by_b;
  };
  static std::vector<Node>& nodes() {
    static std::vector<Node> nodes;
    return nodes;
  }
  static int add(int a, double by_a, int b, double by_b) {
    nodes().push_back({a, b, by_a, by_b});
    return int(nodes().size()) - 1;
  }
};

struct Number {
  double value = 0;
  int node = -1;

  Number() = default;
  Number(double constant) : value(constant) {}  // NOLINT: as numbers are
  Number(double v, int n) : value(v), node(n) {}
  static Number variable(double v) { return {v, Tape::add(-1, 0, -1, 0)}; }
};
inline Number operator+(Number a, Number b) { return {a.value + b.value, Tape::add(a.node, 1, b.node, 1)}; }
inline Number operator*(Number a, Number b) { return {a.value * b.value, Tape::add(a.node, b.value, b.node, a.value)}; }
inline Number operator/(Number a, Number b) {
  return {a.value / b.value, Tape::add(a.node, 1 / b.value, b.node, -a.value / (b.value * b.value))};
}
inline Number sqrt(Number a) {
  const double root = std::sqrt(a.value);
  return {root, Tape::add(a.node, 0.5 / root, -1, 0)};
}
inline Number sin(Number a) { return {std::sin(a.value), Tape::add(a.node, std::cos(a.value), -1, 0)}; }
inline Number cos(Number a) { return {std::cos(a.value), Tape::add(a.node, -std::sin(a.value), -1, 0)}; }

// A value and its derivatives by x, y and z.
template <class T>
using Jet = std::array<T, 4>;

template <class T>
struct Result {
  Jet<T> distance;
  std::array<T, 6> surface;  // logits, template point
};

template <class T>
std::vector<Jet<T>> affine(const FieldShape& shape, const std::vector<std::vector<T>>& weights, int layer,
                           const std::vector<Jet<T>>& in, bool is_activated) {
  using std::sqrt;
  const size_t inputs = size_t(shape.inputs(layer));
  std::vector<Jet<T>> out(size_t(shape.outputs(layer)));
  for (size_t o = 0; o < out.size(); ++o) {
    Jet<T> v{weights[size_t(layer)][out.size() * inputs + o], T(0.0), T(0.0), T(0.0)};
    for (size_t i = 0; i < inputs; ++i) {
      for (size_t c = 0; c < 4; ++c) v[c] = v[c] + weights[size_t(layer)][o * inputs + i] * in[i][c];
    }
    if (is_activated) {
      const T root = sqrt(v[0] * v[0] + T(double(shape.smoothing)));
      const T slope = (T(1.0) + v[0] / root) * T(0.5);
      v[0] = (v[0] + root) * T(0.5);
      for (size_t c = 1; c < 4; ++c) v[c] = slope * v[c];
    }
    out[o] = v;
  }
  return out;
}

// weights: of each layer [outputs][inputs], then [outputs] biases.
template <class T>
Result<T> evaluate(const FieldShape& shape, const std::vector<std::vector<T>>& weights, const std::array<T, 3>& point,
                   bool has_surface = true) {
  using std::cos;
  using std::sin;
  std::vector<Jet<T>> encoding;
  for (size_t d = 0; d < 3; ++d) {
    Jet<T> x{point[d], T(0.0), T(0.0), T(0.0)};
    x[1 + d] = T(1.0);
    encoding.push_back(x);
  }
  for (int octave = 0; octave < shape.octaves; ++octave) {
    const T frequency(std::ldexp(1.0, octave));
    for (const bool is_sine : {true, false}) {
      for (size_t d = 0; d < 3; ++d) {
        const T angle = frequency * point[d];
        Jet<T> e{is_sine ? sin(angle) : cos(angle), T(0.0), T(0.0), T(0.0)};
        e[1 + d] = is_sine ? frequency * cos(angle) : T(-1.0) * frequency * sin(angle);
        encoding.push_back(e);
      }
    }
  }
  std::vector<Jet<T>> h = encoding;
  for (int layer = 0; layer < shape.geometry_layers; ++layer) h = affine(shape, weights, layer, h, true);
  h = affine(shape, weights, shape.geometry_layers, h, false);
  Result<T> result;
  result.distance = h[0];
  if (!has_surface) return result;
  h.insert(h.end(), encoding.begin(), encoding.begin() + 3);
  for (int layer = shape.first_surface_layer(); layer < shape.layers(); ++layer) {
    h = affine(shape, weights, layer, h, layer + 1 < shape.layers());
  }
  for (size_t i = 0; i < 6; ++i) result.surface[i] = h[i][0];
  return result;
}

inline std::vector<std::vector<double>> as_lists(const FieldWeights& weights) {
  std::vector<std::vector<double>> lists;
  for (int index = 0; index < weights.shape().layers(); ++index) {
    const maq::head::ConstFieldLayer layer = weights.layer(index);
    std::vector<double> list;
    for (int o = 0; o < layer.outputs; ++o) list.insert(list.end(), layer.row(o), layer.row(o) + layer.inputs);
    list.insert(list.end(), layer.bias, layer.bias + layer.outputs);
    lists.push_back(list);
  }
  return lists;
}

// The gradient of a loss: by weights as as_lists() has them, and by the points.
struct Gradients {
  std::vector<std::vector<double>> weights;
  std::vector<std::array<double, 3>> points;
};

// `seeds(i)`: the loss's derivatives by distance, its gradient by x, y, z, and the six outputs of the surface.
template <class Seeds>
Gradients gradients(const FieldWeights& weights, const std::array<std::vector<float>, 3>& points, bool has_surface,
                    const Seeds& seeds) {
  const FieldShape& shape = weights.shape();
  const std::vector<std::vector<double>> values = as_lists(weights);
  Tape::nodes().clear();
  std::vector<std::vector<Number>> variables;
  for (const std::vector<double>& list : values) {
    variables.emplace_back();
    for (const double value : list) variables.back().push_back(Number::variable(value));
  }
  const size_t leaves = Tape::nodes().size();
  Gradients result;
  std::vector<double> sums(leaves, 0.0);
  for (size_t i = 0; i < points[0].size(); ++i) {
    Tape::nodes().resize(leaves);
    std::array<Number, 3> point;
    for (size_t d = 0; d < 3; ++d) point[d] = Number::variable(double(points[d][i]));
    const Result<Number> at = evaluate(shape, variables, point, has_surface);
    std::vector<double> adjoints(Tape::nodes().size(), 0.0);
    const std::array<double, 10> seed = seeds(i);
    for (size_t c = 0; c < 4; ++c) adjoints[size_t(at.distance[c].node)] += seed[c];
    for (size_t c = 0; has_surface && c < 6; ++c) adjoints[size_t(at.surface[c].node)] += seed[4 + c];
    for (size_t n = adjoints.size(); n-- > leaves;) {
      const Tape::Node& node = Tape::nodes()[n];
      if (node.a >= 0) adjoints[size_t(node.a)] += node.by_a * adjoints[n];
      if (node.b >= 0) adjoints[size_t(node.b)] += node.by_b * adjoints[n];
    }
    for (size_t n = 0; n < leaves; ++n) sums[n] += adjoints[n];
    result.points.push_back({adjoints[leaves], adjoints[leaves + 1], adjoints[leaves + 2]});
  }
  size_t next = 0;
  for (const std::vector<double>& list : values) {
    result.weights.emplace_back(sums.begin() + long(next), sums.begin() + long(next + list.size()));
    next += list.size();
  }
  return result;
}

inline FieldWeights random_weights(const FieldShape& shape, unsigned seed) {
  std::mt19937 random(seed);
  FieldWeights weights(shape);
  for (int index = 0; index < shape.layers(); ++index) {
    const maq::head::FieldLayer layer = weights.layer(index);
    std::normal_distribution<float> weight(0.0f, std::sqrt(2.0f / float(layer.inputs)));
    std::uniform_real_distribution<float> bias(-0.2f, 0.2f);
    for (int o = 0; o < layer.outputs; ++o) {
      for (int i = 0; i < layer.inputs; ++i) layer.row(o)[i] = weight(random);
      layer.bias[o] = bias(random);
    }
  }
  return weights;
}

using Columns = std::array<std::vector<float>, 3>;

inline Columns random_columns(size_t count, unsigned seed, float reach) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-reach, reach);
  Columns columns;
  for (std::vector<float>& column : columns) {
    for (size_t i = 0; i < count; ++i) column.push_back(uniform(random));
  }
  return columns;
}

inline maq::head::FieldPoints as_points(const Columns& columns) {
  return {columns[0].data(), columns[1].data(), columns[2].data(), columns[0].size()};
}

inline maq::head::Planes as_planes(Columns& columns) {
  return {columns[0].data(), columns[1].data(), columns[2].data()};
}

inline maq::head::ConstPlanes as_const_planes(const Columns& columns) {
  return {columns[0].data(), columns[1].data(), columns[2].data()};
}

// The largest difference of two arrays, by the largest of the second.
template <class A, class B>
double relative_error(const A& a, const B& b) {
  double difference = 0, size = 1e-30;
  for (size_t i = 0; i < b.size(); ++i) {
    const double error = std::abs(double(a[i]) - double(b[i]));
    difference = std::isfinite(error) ? std::max(difference, error) : INFINITY;
    size = std::max(size, std::abs(double(b[i])));
  }
  return difference / size;
}

// A gradient by all weights and by the points [3][n], within 1e-4 of the reference.
inline void expect_gradients(const FieldWeights& by_weights, const std::array<std::vector<float>, 3>& by_points,
                             const Gradients& expected) {
  const auto lists = as_lists(by_weights);
  for (size_t layer = 0; layer < lists.size(); ++layer) {
    EXPECT_LE(relative_error(lists[layer], expected.weights[layer]), 1e-4) << "layer " << layer;
  }
  for (size_t c = 0; c < 3; ++c) {
    std::vector<double> by_point;
    for (const std::array<double, 3>& point : expected.points) by_point.push_back(point[c]);
    EXPECT_LE(relative_error(by_points[c], by_point), 1e-4) << "axis " << c;
  }
}

}  // namespace reference_field
