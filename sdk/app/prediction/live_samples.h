// Samples possible futures of a stream (maq_predictor_sample) on a second thread: the entropy by cell, and one sampled
// image. Samples as often as half of a processor core allows, after the latest frame at that time.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <maquette/maquette.hpp>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "app/rgba_image.h"

namespace maquette {

struct SampleChoice {
  double ahead_s = 0.2;
  bool decodes_image = false;  // of the sample, besides its entropy
};

struct SampledFuture {
  std::vector<float> bits;   // entropy map, 16 rows of 16; 0 while nothing moves
  double mean_bits = 0;      // of all cells
  RgbaImage image;           // empty unless decodes_image
  int64_t timestamp_ns = 0;  // of the frame that it follows
  double ahead_s = 0;        // of the sampled frame, after that one
  double sample_ms = 0;      // wall-clock time
  uint64_t number = 0;       // 0: none yet
};

class LiveSamples {
 public:
  // The thread loads the networks from the folder `bundle`; "": the bundle installed with the library. `rests`: false
  // samples after every frame that is waited for. `on_change` is called on the thread after each sample, and when there
  // is a problem(); it must not throw. The context must outlive this.
  LiveSamples(const Context& context, const std::string& bundle, const SampleChoice& choice, bool rests,
              std::function<void()> on_change);
  ~LiveSamples();  // waits for the running sample

  // Adds the stream's next frame as a small copy. Some frames of a fast stream are left out.
  void push(const Frame& frame);
  void set_choice(const SampleChoice& choice);
  // Waits for a sample after the latest frame, or for a problem.
  void wait();

  // Returns true and swaps `sampled` with the newest sample if it was not taken yet.
  bool take(SampledFuture& sampled);
  // Returns the reason for having no samples, such as a bundle without networks; "" otherwise.
  std::string problem() const;

 private:
  void run();
  void sample_until_the_end();
  SampledFuture sample(Predictor& predictor, const SampleChoice& choice, int64_t timestamp_ns) const;

  const Context& context_;
  const std::string bundle_;
  const bool rests_;
  const std::function<void()> on_change_;
  int64_t pushed_ns_ = 0;  // of the pushing thread: timestamp of the latest frame
  bool has_pushed_ = false;

  mutable std::mutex mutex_;  // guards the members below, to the next line
  std::condition_variable wake_, sampled_;
  std::deque<Frame> frames_;  // not pushed yet
  SampleChoice choice_;
  SampledFuture newest_;
  bool has_newest_ = false, ends_ = false;
  bool is_due_ = false, is_sampling_ = false;  // a sample after the latest frame is due; is running
  std::string problem_;

  std::thread thread_;
};

}  // namespace maquette
