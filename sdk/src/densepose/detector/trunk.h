// The trunk (backbone and feature pyramid) over an image or a crop.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "densepose/bundle/manifest.h"
#include "densepose/bundle/networks.h"
#include "densepose/detector/roi_align.h"
#include "nn/sized_sessions.h"

namespace maq {

class Trunk {
 public:
  static constexpr int kFirstLevel = 2;
  static constexpr size_t kAllLevels = 5;      // P2 to P6
  static constexpr size_t kFeatureLevels = 4;  // P2 to P5, which the heads read

  // Opens the graph "trunk" of the manifest, which gives all levels and the person-logit map if the bundle has one.
  Trunk(const DensePoseNetworks& networks, const DensePoseSpec& spec);
  // Opens the graph "crop_trunk", which gives P2. `channels`: of the features, those of the trunk.
  Trunk(const DensePoseNetworks& networks, const DensePoseSpec& spec, int channels);
  Trunk(const Trunk&) = delete;
  Trunk& operator=(const Trunk&) = delete;

  int channels() const { return channels_; }
  // Runs over `values`, [3, height_px, width_px], normalised; the sides are multiples of the spec's. Returns the
  // provider in use. The maps below are valid until the next run.
  maq_provider run(const std::vector<float>& values, int width_px, int height_px, RunCancel& cancel);
  const std::vector<TensorView>& pyramid() const { return pyramid_; }    // P2 to P6, or P2
  const std::vector<FeatureMap>& features() const { return features_; }  // P2 to P5, or P2
  // One channel; its mean over a box is added to the logit of a person. Without data if the bundle has no such map.
  const FeatureMap& person_logits() const { return person_logits_; }

  // Measures the number of threads on which the trunk is fastest, for frames with sides of 4 to 3.
  static int measured_threads(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const Bundle& bundle,
                              const DensePoseSpec& spec, int long_side_px, SessionSettings settings);

 private:
  void open_sized(const DensePoseNetworks& networks, const GraphSpec& graph);

  const DensePoseSpec& spec_;
  const size_t levels_;
  int channels_ = 0;
  std::unique_ptr<Session> session_;
  // In its place for other providers than the CPU, which want to know the sizes.
  std::vector<uint8_t> bytes_;
  std::optional<SizedSessions> sized_;
  std::vector<TensorView> pyramid_;
  std::vector<FeatureMap> features_;
  FeatureMap person_logits_;
  std::vector<TensorView> inputs_;
  std::vector<Shape> shapes_;
};

}  // namespace maq
