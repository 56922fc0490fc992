// VP9 frames, by libvpx.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "core/frame.h"

namespace maq {

class Vp9Encoder {
 public:
  // Both sides are even. Throws MAQ_ERROR_UNSUPPORTED for a size that VP9 does not have, and on Android, and
  // std::bad_alloc.
  Vp9Encoder(int width_px, int height_px);
  ~Vp9Encoder();
  Vp9Encoder(const Vp9Encoder&) = delete;
  Vp9Encoder& operator=(const Vp9Encoder&) = delete;

  struct Packet {
    const uint8_t* bytes;  // valid until the next call
    size_t size;
    bool is_key;
  };
  // Encodes the next image, BGR8 of the encoder's size. The result does not depend on the machine. Throws
  // MAQ_ERROR_INTERNAL and std::bad_alloc.
  Packet encode(const ImageView& bgr);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace maq
