// A source, what it will show next and how surprising what it shows is (maquette/prediction.h), on a thread of its own,
// for programs with a window; short gaps of a camera are bridged on request (maquette/concealer.h), which a pipeline
// does not do, and how uncertain what comes is is found beside (live_draws.h).
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
#include "app/prediction/live_draws.h"
#include "app/rgba_image.h"

namespace maquette {

struct PredictionChoice {
  double ahead_s = 0.2;
  maq_prediction_method method = MAQ_PREDICTION_AUTO;  // with MAQ_PREDICTION_NETWORK, mended
  bool bridges_gaps = false;                           // of a source that plays in real time; others have none
  bool finds_surprise = false;
  bool finds_uncertainty = false, draws_sample = false;  // of next; the second: a picture that may come, drawn
  std::string bundle;  // folder of the networks; "": the one installed with the library
};

struct SurpriseMoment {
  maq_surprise_score score{};
  double time_s = 0;  // timestamp of its frame, after that of the first
};

struct PredictionFrame {
  RgbaImage now, next;          // next: what comes, of the same size
  maq_frame_origin origin{};    // of now: captured, or predicted in a gap
  double ahead_s = 0;           // of next, after now
  double made_ahead_s = 0;      // of next, after the captured frame that it was made from; longer in a gap
  maq_predictor_stats stats{};  // of next
  maq_concealer_stats gaps{};   // since the bridging was switched on
  bool bridges_gaps = false;
  std::deque<SurpriseMoment> surprise;  // of the latest captured frames, at most 300; empty where it is not wanted
  std::vector<float> surprise_bits;     // of the last of them, score.rows rows of score.columns cells
  double surprise_ms = 0;               // that it took
  DrawnFuture drawn;                    // the latest, of an earlier frame mostly; number 0: none, or not wanted
  double drawn_age_ms = 0;              // of that frame when `now` was shown
  double drawn_freshness = 0;           // 1, less from 0.5 s on, 0 from 2 s on: how much it says of `next`
  double waiting_ms = 0, results_per_second = 0;
  uint64_t number = 0;  // 0: none yet
};

// What a window says of `next`: how far ahead it is, and what made it; and how old its uncertainty
// is. Of what was drawn likewise.
std::string text_of_method(const maq_predictor_stats& stats);
std::string text_of_next(const PredictionFrame& frame, bool has_uncertainty);
std::string text_of_drawn(const PredictionFrame& frame);

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
  void set_recording(const std::string& path) override;  // of captured frames alone
  LiveStatus status() const override;

  // Another method, which learns from the frames that come then, and another time ahead.
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
  void switch_surprise(const PredictionChoice& choice);
  void find_surprise(const Frame& frame);
  void switch_draws(const PredictionChoice& choice);
  bool take_draw();
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

  mutable std::mutex mutex_;  // of what follows to the next line
  std::condition_variable wake_, closed_;
  Wanted wanted_;
  LiveStatus status_;
  std::string fallback_;
  bool is_changed_ = false, opens_ = false, ends_ = false, is_open_ = false;
  std::chrono::steady_clock::time_point retry_until_;  // while another view lets the camera go

  // Of the thread alone:
  std::optional<Source> source_;
  std::optional<Concealer> concealer_;  // after its source
  std::optional<Recorder> recorder_;
  std::optional<Predictor> predictor_;
  maq_prediction_method method_ = MAQ_PREDICTION_AUTO;
  std::string recording_;
  std::optional<Surprise> surprise_;
  bool is_surprise_switched_ = false;  // on; without surprise_ it could not be made
  std::optional<LiveDraws> draws_;
  bool has_draw_problem_ = false;  // it was told
  int64_t first_ns_ = 0;           // timestamp of the first frame whose surprise was found
  PredictionFrame frame_;
  int64_t pushed_ns_ = 0, shown_ns_ = 0;  // timestamps of the latest captured frame, and of `now`
  bool has_pushed_ = false;
  std::string fallback_reason_;
  std::deque<std::chrono::steady_clock::time_point> times_;  // of the frames of the last second
  std::thread thread_;
};

}  // namespace maquette
