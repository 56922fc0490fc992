// Dense pose of one image: detector, box head, dense head and the decode between and after them.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/frame.h"
#include "densepose/chart_predictor.h"
#include "densepose/dense_decode.h"
#include "densepose/manifest.h"
#include "densepose/person_crop.h"
#include "densepose/proposals.h"
#include "densepose/roi_align.h"
#include "densepose/rotated_input.h"
#include "densepose/surface_grid.h"
#include "image/crop_input.h"
#include "image/network_input.h"
#include "nn/bundle.h"
#include "nn/session.h"
#include "nn/sized_sessions.h"

namespace maq {

enum class PersonCrops { kOff, kAuto, kAll };  // as maq_densepose_crops

// As in maq_densepose_config, whose comments say what they mean; 0 (a negative threshold): the bundle's value.
struct DensePoseSettings {
  int threads = 1;  // or MAQ_THREADS_MEASURED
  int long_side_px = 0;
  float score_threshold = -1;
  int max_people = 0;
  int max_proposals = 0;
  int key_frame_interval = 1;
  int min_person_height_px = 0;
  PersonCrops crops = PersonCrops::kOff;
  int crop_side_px = 0;
  bool surface = true;
  bool spin = true;
  maq_provider provider = MAQ_PROVIDER_CPU;
};

struct Person {
  Box box;  // in pixels of the image
  float score = 0;
};

struct DensePoseStats {
  float preprocess_ms = 0;
  float trunk_ms = 0;  // backbone and FPN neck
  float proposals_ms = 0;
  float box_head_ms = 0;
  float dense_head_ms = 0;
  float crops_ms = 0;
  float decode_ms = 0;
  float total_ms = 0;
  int network_width_px = 0;
  int network_height_px = 0;
  bool key_frame = false;
  maq_provider provider = MAQ_PROVIDER_CPU;  // of the trunk
  int threads = 1;
  bool is_threads_measured = false;
  int proposals = 0;
  int dropped_boxes = 0;
  int crops = 0;
  DecodeCounts decoded;
};

struct DensePoseResult {
  std::vector<Person> people;  // best score first; each has at least one pixel of `planes`
  DensePlanes planes;
  DensePoseStats stats;
};

class DensePose {
 public:
  // Makes the networks of `bundle`, which is not needed afterwards. Throws MAQ_ERROR_BAD_BUNDLE, and
  // MAQ_ERROR_UNSUPPORTED for a bundle of another task.
  DensePose(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle, const DensePoseSettings& settings);

  DensePose(const DensePose&) = delete;
  DensePose& operator=(const DensePose&) = delete;

  // Memory of `result` is reused. Not for two threads at once. With key_frame_interval above 1 images are frames of one
  // stream: between key frames the boxes of the frame before take the place of proposals. Throws MAQ_ERROR_INFERENCE,
  // MAQ_CANCELLED.
  void run(const ImageView& image, DensePoseResult& result);
  // From any thread: ends the run that runs, or else the next.
  void cancel() noexcept { cancel_->cancel(); }
  // The next image begins another stream.
  void reset();

  // In use: where the settings have MAQ_THREADS_MEASURED, what was measured when this was made.
  int threads() const { return settings_.threads; }
  int long_side_px() const { return settings_.long_side_px; }
  int key_frame_interval() const { return settings_.key_frame_interval; }
  // Between two runs: takes effect with the next, which is a key frame where the long side changes. No network is made
  // anew, unless another provider than the CPU runs them.
  void set_quality(int key_frame_interval, int long_side_px);

  // From any thread: the pictures of the next runs show the world rotated clockwise by `rad`, -7 to 7. The
  // networks see them rotated upright, by steps of kRollStepRad; where the step changes, a key frame begins.
  void set_roll(float rad) noexcept { roll_rad_ = rad; }

  // Where on the body labels lie; from any thread, also during run(). Throws what BodySurface::grid() throws.
  const SurfaceGrid& surface() { return surface_.grid(); }

 private:
  // A person whom the dense head sees.
  struct MappedPerson {
    ScoredBox found;  // in pixels of the network's input
    Box box;          // in pixels of the image
    Box beyond_body;  // from the bounds of the painted body to `box`, side by side, when the box head saw it
    std::optional<PersonCrop> first_view;  // where the first answer lies, of an image that was rotated
    std::optional<PersonCrop> crop;
    float confidence = 0;           // of the answer in use, or of the first until there is one of the crop
    int64_t body_pixels = 0;        // when last painted
    const float* labels = nullptr;  // a dense head's answer, of the crop where there is one
    const float* surface = nullptr;
    ChartPredictor* charts = nullptr;  // of that dense head
  };

  // What maps the surface, of whole images or of crops.
  struct Mapper {
    Session* trunk = nullptr;
    SizedSessions* sized_trunk = nullptr;  // in its place, unless null
    Session* dense_head = nullptr;
    ChartPredictor* charts = nullptr;
    size_t levels = 0;  // that the trunk gives
  };

  void find_people(const ImageView& image, DensePoseResult& result);
  // Of the trunk's outputs for such an input, into `shapes_`; of one that gives all levels the evidence, too.
  void set_level_shapes(int width_px, int height_px, size_t levels);
  // How many threads the trunk, which takes the longest, is fastest on.
  int measured_threads(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const Bundle& bundle,
                       const GraphSpec& trunk, SessionSettings settings);
  // `values`: [3, height_px, width_px], normalised; the sides are multiples of the spec's. Into `features_`.
  // Returns the provider in use.
  maq_provider run_trunk(const Mapper& mapper, const std::vector<float>& values, int width_px, int height_px);
  // The best boxes of the RPN. Its finest level runs only where people of min_person_height_px may be that small.
  void propose(std::vector<ScoredBox>& found, int* dropped);
  // One pass of the box head: scores and refines `boxes`, keeps those of a score above `min_score`, then NMS.
  void run_box_head(const std::vector<ScoredBox>& boxes, float min_score, std::vector<ScoredBox>& found, int* dropped);
  // Finds people in the whole image, at key frames, or follows those of the frame before; into `found_`.
  void find_boxes(const ImageView& image, DensePoseStats& stats);
  // Runs the dense head on `found_`, then on crops of those who gain by it; into `mapped_`.
  void map_people(const ImageView& image, const DensePlanes& planes, DensePoseStats& stats);
  // Of the first `count` RoIs in `rois_`: labels and surface, in memory of the session until it runs again.
  const std::vector<TensorView>& run_dense_head(const Mapper& mapper, size_t count);
  // Values of one person's RoI, labels and surface.
  size_t dense_roi_size() const;
  size_t labels_size() const;
  size_t surface_size() const;
  DenseLogits logits_of(const MappedPerson& person);
  // Gives crops to the people of `mapped_` who gain by one.
  void choose_crops();
  // Runs trunk and dense head over the crops of `mapped_`. Those answers take the place of the first, unless they are
  // clearly less confident; then the person loses the crop.
  void run_crops(const ImageView& image, DensePoseStats& stats);
  // The person's score, in which the confidence of the answer counts as well.
  float score_with_confidence(const MappedPerson& person) const;
  // Of `mapped_`, by that score.
  void drop_unlikely();
  void sort_by_score();  // `mapped_`, best first
  // Paints `mapped_` and adds those who got a pixel to `result`; they are followed in the next frame.
  void paint_people(DensePoseResult& result);
  // Gives the person, who was painted last, the crop of the next frame, and between key frames the box of this one.
  void follow_in_crop(MappedPerson& person, const DensePoseResult& result);
  const FeatureMap& level_for(const Box& box) const;
  // What speaks for a person in `box`, to be added to the box head's logit; 0 where the bundle has no such map.
  float evidence_in(const Box& box);

  DensePoseSpec spec_;
  bool measures_threads_;
  DensePoseSettings settings_;  // none is 0 that stands for the bundle's value, and threads are those in use
  int channels_ = 0;
  std::unique_ptr<RunCancel> cancel_;
  std::unique_ptr<Session> trunk_;
  std::unique_ptr<Session> rpn_fine_;
  std::unique_ptr<Session> rpn_coarse_;
  std::unique_ptr<Session> box_head_;
  std::unique_ptr<Session> dense_head_;
  ChartPredictor charts_;
  // For other providers than the CPU, which want to know the sizes; the bytes are those of the networks.
  std::vector<uint8_t> trunk_bytes_, crop_trunk_bytes_;
  std::optional<SizedSessions> sized_trunk_, sized_crop_trunk_;
  std::unique_ptr<Session> crop_trunk_, crop_dense_head_;  // null where crops go through those above
  std::optional<ChartPredictor> crop_charts_;
  Mapper whole_, crops_;
  BodySurface surface_;
  std::atomic<float> roll_rad_{0};
  RotatedInput seen_;  // of the image before, while none is run
  NetworkInput input_;
  std::vector<TensorView> pyramid_;   // P2 to P6, or P2, in memory of a trunk
  std::vector<FeatureMap> features_;  // the same, without P6
  FeatureMap evidence_;               // of people, one channel; without data where the bundle has none
  std::vector<float> rois_;
  std::vector<MappedPerson> mapped_;
  // Scratch of a frame, kept so that the next one takes nothing from the heap.
  RoiAlign roi_align_;
  DecodeMemory decode_memory_;
  CropInput crop_input_;
  std::vector<float> first_answers_;  // from the whole image, while the dense head runs again
  std::vector<RpnCandidate> candidates_;
  std::vector<RpnLevel> rpn_levels_;
  std::vector<ScoredBox> proposals_, found_;
  std::vector<TensorView> inputs_;
  std::vector<Shape> shapes_;
  // People of the frame before, to be followed: by their boxes or, where all have crops, in these alone.
  std::vector<MappedPerson> tracked_;
  bool tracks_crops_ = false;
  int image_width_px_ = 0, image_height_px_ = 0;
  int frames_since_key_ = 0;
};

}  // namespace maq
