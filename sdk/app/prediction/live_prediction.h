// Plays a source with its predicted frames (maquette/prediction.h) and a check of its camera (maquette/camera_health.h)
// on a thread of its own, for programs with a window. Fills short gaps on request (maquette/concealer.h), which a
// pipeline does not. live_samples.h estimates the uncertainty in parallel.
//
//   maquette::LivePrediction live(context, {}, [&](const maquette::PredictionFrame& frame) { … });
//   live.open("stub:people?stall=300ms@3s");
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <maquette/maquette.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/live_pipeline.h"
#include "app/prediction/live_samples.h"
#include "app/rgba_image.h"

namespace maquette {

struct PredictionChoice {
  double ahead_s = 0.2;
  maq_predictor_method method = MAQ_PREDICTOR_AUTO;
  bool conceals_gaps = false;  // of a source that plays in real time; others have no gaps
  bool checks_camera = false;
  bool shows_entropy = false, shows_sample = false;  // of the predicted frame; a sampled frame beside it
  std::string bundle;                                // folder of the networks; "": the one installed with the library
};

struct HealthMoment {
  maq_camera_health_result result{};
  double time_s = 0;  // timestamp of its frame, relative to the first frame
};

struct PredictionFrame {
  RgbaImage now, next;           // next: the predicted frame, of the same size
  maq_frame_origin origin{};     // of `now`: captured, or predicted in a gap
  double ahead_s = 0;            // of `next`, after `now`
  double predicted_ahead_s = 0;  // of `next`, after the captured frame; longer in a gap
  maq_predictor_stats stats{};   // of `next`
  maq_concealer_stats gaps{};    // since concealment was switched on
  bool conceals_gaps = false;
  std::deque<HealthMoment> health;  // of the latest captured frames, at most 300; empty unless wanted
  std::vector<float> health_map;    // of the last one, result.rows rows of result.columns cells
  double health_ms = 0;             // that it took
  SampledFuture sampled;            // the latest, mostly after an earlier frame; number 0: none
  double sample_age_ms = 0;         // of that frame when `now` was shown
  double sample_freshness = 0;      // 1 up to 0.5 s of age, falling to 0 at 2 s
  double waiting_ms = 0, results_per_second = 0;
  uint64_t number = 0;  // 0: none yet
};

// Texts for a window: the method of a prediction; time ahead, method and age of the entropy; time ahead and age of the
// sample.
std::string text_of_method(const maq_predictor_stats& stats);
std::string text_of_next(const PredictionFrame& frame, bool has_entropy);
std::string text_of_sample(const PredictionFrame& frame);

class LivePrediction final : public LivePlayer {
 public:
  // `on_frame` is called on this object's thread with each frame and again where ahead_s changes while nothing plays;
  // `on_change`, which may be null, on that thread or one of the source with each change of the status. Neither may
  // throw. The context must outlive this.
  LivePrediction(const Context& context, const PredictionChoice& choice,
                 std::function<void(const PredictionFrame&)> on_frame, std::function<void()> on_change = nullptr,
                 const LiveOptions& options = {});
  ~LivePrediction() override;  // waits until a device that is being opened answers

  void open(const std::string& uri, const std::string& fallback = "") override;
  void close() override;  // waits until the source is closed, for 0.2 s at most
  void set_paused(bool is_paused) override;
  void set_recording(const std::string& path) override;  // captured frames only
  LiveStatus status() const override;

  // Sets another method, which starts from the frames that come then, or another time ahead.
  void set_choice(const PredictionChoice& choice);

 private:
  struct Wanted {
    PredictionChoice choice;
    bool is_paused = false;
    std::string recording;
  };

  void run();
  void open_source();
  void close_source();
  void apply(const Wanted& wanted);
  void record(const std::function<void()>& step);
  void switch_method(const PredictionChoice& choice);
  void switch_health(bool is_on);
  void check_camera(const Frame& frame);
  void switch_samples(const PredictionChoice& choice);
  bool take_sample();
  void play_frame(const Wanted& wanted);
  void show(Frame frame, const Wanted& wanted);
  void predict(double ahead_s);
  void end(const std::string& problem);
  void enter(maq_pipeline_state state, const std::string& problem);
  void take_camera_state(maq_source_state state, const char* reason);

  const Context& context_;
  const std::function<void(const PredictionFrame&)> on_frame_;
  const std::function<void()> on_change_;
  const LiveOptions options_;

  mutable std::mutex mutex_;  // guards the members below, to the next line
  std::condition_variable wake_, closed_;
  Wanted wanted_;
  LiveStatus status_;
  std::string fallback_;
  bool is_changed_ = false, opens_ = false, ends_ = false, is_open_ = false;
  std::chrono::steady_clock::time_point retry_until_;  // while another view still has the camera

  // Used by the thread only:
  std::optional<Source> source_;
  std::optional<Concealer> concealer_;  // after its source
  std::optional<Recorder> recorder_;
  std::optional<Predictor> predictor_;
  maq_predictor_method method_ = MAQ_PREDICTOR_AUTO;
  std::string recording_;
  std::optional<CameraHealth> health_;
  std::optional<LiveSamples> samples_;
  bool has_sample_problem_ = false;  // it was reported
  int64_t first_ns_ = 0;             // timestamp of the first checked frame
  PredictionFrame frame_;
  int64_t pushed_ns_ = 0, shown_ns_ = 0;  // timestamps of the latest captured frame, and of `now`
  bool has_pushed_ = false;
  std::string fallback_reason_;
  std::deque<std::chrono::steady_clock::time_point> times_;  // of the frames of the last second
  std::thread thread_;
};

}  // namespace maquette
