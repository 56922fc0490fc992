// What every source is.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/bounded_pool.h"
#include "core/frame.h"
#include "core/log.h"

namespace maq {

struct SourceInfo {
  int width_px = 0;
  int height_px = 0;
  double fps = 0;            // 0 for a single image
  int64_t frame_count = -1;  // -1: not known, or endless
  bool is_live = false;
  maq_clock clock = MAQ_CLOCK_MEDIA;
};

class Source {
 public:
  virtual ~Source() = default;
  virtual const SourceInfo& info() const = 0;
  // Fills `frame` (pixels, time, sequence) with the next frame; false after the last one.
  virtual bool next(int64_t timeout_ns, Frame& frame) = 0;
};

struct SourceScheme {
  const char* name;
  const char* example;
  const char* summary;
};

// Every scheme of this build.
const std::vector<SourceScheme>& source_schemes();

// Throws MAQ_ERROR_UNSUPPORTED for a scheme that is not in the list, and what the source throws.
std::unique_ptr<Source> open_source(const std::string& uri);

// A source with its pool: what the C API hands out.
class PooledSource {
 public:
  PooledSource(std::unique_ptr<Source> source, size_t pool_size)
      : source_(std::move(source)), pool_(pool_size, "frames") {}

  const SourceInfo& info() const { return source_->info(); }
  size_t pool_size() const { return pool_.capacity(); }

  // Nothing after the last frame.
  std::shared_ptr<Frame> next(int64_t timeout_ns) {
    std::shared_ptr<Frame> frame = pool_.acquire();
    if (!source_->next(timeout_ns, *frame)) return nullptr;
    return frame;
  }

 private:
  std::unique_ptr<Source> source_;
  BoundedPool<Frame> pool_;
};

}  // namespace maq
