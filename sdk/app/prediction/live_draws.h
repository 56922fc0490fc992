// What a stream may show next, drawn by networks (maq_predictor_draw) on a thread of its own beside one that plays the
// stream: how uncertain that is and where, and the picture that was drawn. It is drawn as often as half of a processor
// allows, after whichever frame is the latest then.
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

struct DrawChoice {
  double ahead_s = 0.2;
  bool makes_picture = false;  // of what was drawn, besides its uncertainty
};

struct DrawnFuture {
  std::vector<float> bits;   // of a code by cell, 16 rows of 16; 0 where nothing moves
  double mean_bits = 0;      // of all cells
  RgbaImage picture;         // empty where it is not wanted
  int64_t timestamp_ns = 0;  // of the frame that it was drawn after
  double ahead_s = 0;        // of what was drawn, after that frame
  double draw_ms = 0;        // that it took
  uint64_t number = 0;       // 0: none yet
};

class LiveDraws {
 public:
  // The networks are loaded on the thread from the folder `bundle`, or where it is "" from the one installed with the
  // library. `rests`: false draws after every frame that is waited for. `on_change` is called on the thread after each
  // draw, and when there is a problem(); it must not throw. The context must outlive this.
  LiveDraws(const Context& context, const std::string& bundle, const DrawChoice& choice, bool rests,
            std::function<void()> on_change);
  ~LiveDraws();  // waits for the draw at hand

  // The stream's next frame, of which a small copy is made; of a fast stream every second or third is left out.
  void push(const Frame& frame);
  void set_choice(const DrawChoice& choice);
  // Until the latest frame was drawn after, or there is a problem.
  void wait();

  // True when `drawn` has become the newest draw, which was not taken yet.
  bool take(DrawnFuture& drawn);
  // Why there are no draws, as of a bundle without the networks; "" otherwise.
  std::string problem() const;

 private:
  void run();
  void draw_until_the_end();
  DrawnFuture draw(Predictor& predictor, const DrawChoice& choice, int64_t timestamp_ns) const;

  const Context& context_;
  const std::string bundle_;
  const bool rests_;
  const std::function<void()> on_change_;
  int64_t pushed_ns_ = 0;  // of the thread that pushes: timestamp of the latest frame that it did
  bool has_pushed_ = false;

  mutable std::mutex mutex_;  // of what follows, to the next line
  std::condition_variable wake_, drawn_one_;
  std::deque<Frame> frames_;  // not pushed yet
  DrawChoice choice_;
  DrawnFuture newest_;
  bool has_newest_ = false, ends_ = false;
  bool is_due_ = false, is_drawing_ = false;  // a draw after the latest frame; it is being made
  std::string problem_;

  std::thread thread_;
};

}  // namespace maquette
