// Maps people to the body surface: the dense head over their regions of the trunk's features.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "densepose/bundle/manifest.h"
#include "densepose/bundle/networks.h"
#include "densepose/detector/roi_align.h"
#include "densepose/surface/chart_predictor.h"
#include "densepose/surface/dense_decode.h"

namespace maq {

// The output of the dense head for one person.
struct SurfaceAnswer {
  float* labels = nullptr;   // nullptr: there is none yet
  float* surface = nullptr;  // features of U and V
};

class SurfaceMapper {
 public:
  // Opens the graph `name` ("dense_head", "crop_dense_head"). `channels`: of the trunk's features. `surface_channels`:
  // of the graph's output `surface`; 0: those of the charts. `spec` must outlive this. Throws MAQ_ERROR_BAD_BUNDLE.
  SurfaceMapper(const DensePoseNetworks& networks, const DensePoseSpec& spec, const std::string& name,
                const std::string& charts_file, int channels, int surface_channels = 0);

  // Begins a run.
  void begin() { count_ = 0; }
  // Adds a person: the region `box` of the features, in pixels of the trunk's input.
  void add(const FeatureMap& features, const Box& box);
  // Takes back the people whose entry in `keeps` is 0; the others keep their order.
  void drop(const std::vector<uint8_t>& keeps);
  // Runs the dense head over all people. Answers, in the order of add(), are valid until the next run of the mapper.
  void run(RunCancel& cancel);
  SurfaceAnswer answer(size_t index) const;
  // Numbers in an answer.
  size_t labels_size() const;
  size_t surface_size() const;
  int chart_channels() const { return charts_.channels(); }

  // Prepares decoding of an answer of this mapper, which may have been copied. One answer at a time.
  DenseLogits logits_of(const SurfaceAnswer& answer);

 private:
  size_t roi_size() const;

  const DenseHeadSpec& spec_;
  const int channels_;
  ChartPredictor charts_;
  std::unique_ptr<Session> dense_head_;
  RoiAlign roi_align_;
  std::vector<float> rois_;
  size_t count_ = 0;
  float* labels_ = nullptr;
  float* surface_ = nullptr;
  std::vector<TensorView> inputs_;
  std::vector<Shape> shapes_;
};

}  // namespace maq
