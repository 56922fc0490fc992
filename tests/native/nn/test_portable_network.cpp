// The layers of builds without ONNX Runtime (WebAssembly), beside ONNX Runtime: the same bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/log.h"
#include "core/worker_threads.h"
#include "nn/bundle.h"
#include "nn/portable/network.h"
#include "nn/portable/network_builder.h"
#include "nn/portable/onnx_model.h"
#include "nn/session.h"
#include "support/expect_error.h"

namespace {

using maq::Extents;

class PortableNetwork : public ::testing::Test {
 protected:
  static const maq::Bundle& bundle() {
    static const maq::Bundle read = maq::read_bundle(MAQ_TEST_MODELS "/densepose-b-int8");
    return read;
  }

  struct Input {
    std::vector<float> values;
    maq::Shape shape;
  };

  // Waves of several lengths, so that values of all sizes meet.
  static Input waves(const maq::Shape& shape, float height) {
    Input made{{}, shape};
    size_t count = 1;
    for (const int64_t extent : shape) count *= size_t(extent);
    for (size_t i = 0; i < count; ++i) {
      const float x = float(i);
      made.values.push_back(height * (std::sin(0.013f * x) + std::sin(0.41f * x) + std::sin(0.00071f * x)));
    }
    return made;
  }

  // Runs a graph in both ways and compares the outputs of these shapes: exactly, but for a product of floats at the
  // end.
  static void expect_same(const std::string& graph, const std::vector<Input>& inputs,
                          const std::vector<maq::Shape>& shapes, float tolerance = 0) {
    const maq::GraphSpec& spec = bundle().manifest.graphs.at(graph);
    const std::vector<uint8_t>& bytes = bundle().files.at(spec.file);
    const auto runtime = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
    std::vector<maq::TensorView> views;
    for (const Input& input : inputs) views.push_back({input.values.data(), input.shape});
    const auto session = maq::open_session(runtime, bytes, spec, graph, {});
    const std::vector<maq::TensorView>& expected = session->run(views, shapes);

    maq::PortableNetwork network(maq::build_network(maq::read_onnx(bytes, graph), graph));
    std::vector<std::vector<float>> memory;
    std::vector<maq::Tensor> from, to;
    for (const maq::TensorView& view : views) from.push_back({extents_of(view.shape), nullptr, nullptr});
    for (size_t i = 0; i < views.size(); ++i) from[i].floats = const_cast<float*>(views[i].data);
    for (const maq::Shape& shape : shapes) memory.emplace_back(maq::count_of(extents_of(shape)));
    for (size_t i = 0; i < shapes.size(); ++i) to.push_back({extents_of(shapes[i]), nullptr, memory[i].data()});
    for (const int count : {1, 1, 3}) {
      maq::WorkerThreads threads(count);
      network.run(from, to, threads);
      for (size_t i = 0; i < shapes.size(); ++i) {
        for (size_t at = 0; at < memory[i].size(); ++at) {
          ASSERT_NEAR(memory[i][at], expected[i].data[at], tolerance)
              << graph << ", " << spec.outputs[i].name << ", value " << at << ", " << count << " threads";
        }
        std::fill(memory[i].begin(), memory[i].end(), 0.0f);
      }
    }
  }

 private:
  static Extents extents_of(const maq::Shape& shape) {
    if (shape.size() == 2) return {int(shape[0]), 1, 1, int(shape[1])};
    return {int(shape[0]), int(shape[1]), int(shape[2]), int(shape[3])};
  }
};

TEST_F(PortableNetwork, TheTrunkHasTheBitsOfOnnxRuntime) {
  const std::vector<maq::Shape> shapes = {{1, 24, 32, 64}, {1, 12, 16, 64}, {1, 6, 8, 64},
                                          {1, 3, 4, 64},   {1, 2, 2, 64},   {1, 6, 8, 1}};
  expect_same("trunk", {waves({1, 3, 96, 128}, 0.8f)}, shapes, 1e-5f);
}

TEST_F(PortableNetwork, HeadsHaveTheBitsOfOnnxRuntime) {
  expect_same("rpn_fine", {waves({1, 24, 32, 64}, 1)}, {{1, 24, 32, 15}});
  expect_same("box_head", {waves({5, 7, 7, 64}, 1)}, {{5, 6}});
  expect_same("dense_head", {waves({2, 32, 32, 64}, 1)}, {{2, 32, 32, 160}, {2, 32, 32, 64}});
  expect_same("keypoints", {waves({2, 32, 32, 64}, 1)}, {{2, 32, 32, 132}});
}

TEST_F(PortableNetwork, FilesThatAreNoOnnxAreRefused) {
  const maq::GraphSpec& spec = bundle().manifest.graphs.at("rpn_fine");
  std::vector<uint8_t> bytes = bundle().files.at(spec.file);
  for (const size_t size : {size_t(0), size_t(1), bytes.size() / 2, bytes.size() - 1}) {
    const std::vector<uint8_t> cut(bytes.begin(), bytes.begin() + std::ptrdiff_t(size));
    expect_error(MAQ_ERROR_BAD_BUNDLE, "cut.onnx is not a valid ONNX file", [&] { maq::read_onnx(cut, "cut.onnx"); });
  }
}

TEST_F(PortableNetwork, OtherOperatorsAreNamed) {
  maq::OnnxModel model;
  model.inputs.push_back({"image", maq::OnnxType::kFloat, {1, 3, 8, 8}});
  model.nodes.push_back({"Softmax", {"image"}, {"out"}, {}});
  expect_error(MAQ_ERROR_UNSUPPORTED, "it has the operator Softmax", [&] { maq::build_network(model, "other.onnx"); });
}

}  // namespace
