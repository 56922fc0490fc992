// Dense pose of one image: person detector, surface mapper, crop pass, and painting.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "core/frame.h"
#include "densepose/bundle/manifest.h"
#include "densepose/bundle/settings.h"
#include "densepose/crops/crop_pass.h"
#include "densepose/detector/input_scales.h"
#include "densepose/detector/person_detector.h"
#include "densepose/frame_budget.h"
#include "densepose/keypoints/keypoint_finder.h"
#include "densepose/surface/dense_decode.h"
#include "densepose/surface/steady_surface.h"
#include "densepose/surface/surface_grid.h"
#include "densepose/surface/surface_mapper.h"
#include "densepose/tracking/person_tracker.h"
#include "nn/bundle.h"
#include "nn/session.h"

namespace maq {

struct Person {
  Box box;  // in pixels of the image
  float score = 0;
  int64_t id = 0;  // from 1, see maq_densepose_person
};

struct DensePoseStats : DetectorStats {
  float dense_head_ms = 0;
  float crops_ms = 0;
  float decode_ms = 0;
  float keypoints_ms = 0;
  float total_ms = 0;
  int network_width_px = 0;
  int network_height_px = 0;
  bool key_frame = false;
  int threads = 1;
  bool is_threads_measured = false;
  int crops = 0;
  DecodeCounts decoded;
};

struct DensePoseResult {
  std::vector<Person> people;  // best score first; each has at least one pixel of `planes`
  DensePlanes planes;
  std::vector<Keypoints> keypoints;  // of each person, if the settings ask for them; otherwise empty
  DensePoseStats stats;
};

// An image's place in a stream.
struct StreamPlace {
  bool follows = false;            // the previous image is the frame before; otherwise a stream may begin
  std::optional<int64_t> time_ns;  // without it, frames are a thirtieth of a second apart
};

class DensePose {
 public:
  // Opens the networks of `bundle`, which is not needed afterwards. Throws MAQ_ERROR_BAD_BUNDLE, and
  // MAQ_ERROR_UNSUPPORTED for a bundle of another task.
  DensePose(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle, const DensePoseSettings& settings);

  DensePose(const DensePose&) = delete;
  DensePose& operator=(const DensePose&) = delete;

  // Reuses the memory of `result`. One thread at a time. With key_frame_interval above 1, images are frames of one
  // stream: between key frames the boxes of the previous frame replace proposals. Earlier frames count if the image
  // follows them. Throws MAQ_ERROR_INFERENCE, MAQ_CANCELLED.
  void run(const ImageView& image, DensePoseResult& result, const StreamPlace& place = {});
  // From any thread: ends the current run, or the next one if none runs.
  void cancel() noexcept { cancel_->cancel(); }
  // The next image begins another stream.
  void reset();

  // The largest id of a person of the stream; another object can go on with the stream above it.
  int64_t last_person_id() const { return tracker_.last_id(); }
  void number_people_after(int64_t id) { tracker_.begin_stream(id); }

  // The values in use: with MAQ_THREADS_MEASURED, the number that was measured when this was made.
  int threads() const { return settings_.threads; }
  int long_side_px() const { return settings_.long_side_px; }
  int key_frame_interval() const { return settings_.key_frame_interval; }
  // Between two runs: takes effect with the next run, which is a key frame if the long side changes. Opens no network
  // anew, unless another provider than the CPU runs them.
  void set_quality(int key_frame_interval, int long_side_px);

  // From any thread: the images of the next runs show the world rotated clockwise by `rad`, -7 to 7. The networks see
  // them rotated upright, in steps of kRollStepRad. A key frame begins when the step changes.
  void set_roll(float rad) noexcept { roll_rad_ = rad; }

  // Returns the surface that labels refer to. From any thread, also during run(). Throws like BodySurface::grid().
  const SurfaceGrid& surface() { return surface_.grid(); }

 private:
  void map_image(const ImageView& image, DensePoseResult& result);
  // The next frame does not follow the previous one.
  void forget_frame();
  // Decides whether the image is a key frame.
  void begin_frame(const ImageView& image, DensePoseStats& stats);
  // Prepares the image for the networks, at that long side.
  void see(const ImageView& image, int long_side_px, DensePoseStats& stats);
  // Adds the people of the image to `mapped_` and their regions to `mapper_`: of a key frame, or by propagating boxes.
  void detect_people(const ImageView& image, DensePoseStats& stats);
  void follow_people(const ImageView& image, DensePoseStats& stats);
  // In a stream, people who were shown in the previous frame need lower scores.
  const std::vector<ScoredBox>& run_detector(const ImageView& image, const std::vector<ScoredBox>* followed,
                                             DensePoseStats& stats);
  void add_people(const ImageView& image, const std::vector<ScoredBox>& found, const std::vector<uint8_t>* keeps);
  // Returns the region of a person that the dense head sees: in a stream that of the previous frame, if it is near.
  Box region_for(const Box& box) const;
  void drop_people(const std::vector<uint8_t>& keeps);
  void drop_beyond(size_t count);  // the lowest scores
  // Maps the people of `mapped_`, then crops of the people who gain by one.
  void map_people(const ImageView& image, DensePoseStats& stats);
  void drop_unlikely();
  void sort_by_score();  // `mapped_`, best first
  // Paints `mapped_`. Adds the people who got a pixel to `result`, to `tracked_` for the next frame, and to
  // `keypoints_`.
  void paint_people(DensePoseResult& result);
  void find_keypoints(DensePoseResult& result);
  void give_ids(const ImageView& image, DensePoseResult& result);

  DensePoseSpec spec_;
  bool measures_threads_;
  bool chooses_size_;           // among input sizes, at full quality
  DensePoseSettings settings_;  // resolved: with the bundle's values for defaults, and the threads in use
  DensePoseQuality full_;       // as configured
  InputScales scales_;          // used if chooses_size_
  std::unique_ptr<RunCancel> cancel_;
  std::unique_ptr<PersonDetector> detector_;
  std::unique_ptr<SurfaceMapper> mapper_;
  std::unique_ptr<CropPass> crops_;
  std::unique_ptr<KeypointFinder> keypoints_;  // if the settings ask for them
  BodySurface surface_;
  std::atomic<float> roll_rad_{0};
  int roll_steps_ = 0;
  RotatedInput seen_;  // the latest image at its latest size
  // Scratch of a frame, kept so that the next one takes nothing from the heap.
  std::vector<MappedPerson> mapped_;
  DecodeMemory decode_memory_;
  SteadySurface steady_surface_;
  // People of the previous frame, to be followed: by their boxes or, if all have crops, in the crops alone.
  std::vector<MappedPerson> tracked_;
  std::vector<ScoredBox> tracked_boxes_;
  std::vector<Box> shown_boxes_;
  std::vector<ScoredBox> found_, near_people_, all_people_;
  std::vector<uint8_t> keeps_near_, keeps_far_;
  PersonTracker tracker_;
  std::vector<Box> painted_boxes_;
  bool tracks_crops_ = false;
  bool is_forgotten_ = false;  // the previous frame
  int image_width_px_ = 0, image_height_px_ = 0;
  int frames_since_key_ = 0;
  bool is_stream_ = false;  // the image follows the previous one
  StreamPlace place_;
};

}  // namespace maq
