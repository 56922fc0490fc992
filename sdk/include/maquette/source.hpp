// Sources of frames, recordings and clips, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_SOURCE_HPP_
#define MAQUETTE_SOURCE_HPP_

#include <optional>
#include <string>

#include "maquette/clip.h"
#include "maquette/frame.hpp"
#include "maquette/recorder.h"
#include "maquette/source.h"

namespace maquette {

inline maq_source_config default_source_config() {
  maq_source_config config;
  check(maq_source_config_init(&config, sizeof config));
  return config;
}

class Source {
 public:
  Source(const Context& context, const std::string& uri, const maq_source_config* config = nullptr) {
    maq_source* made = nullptr;
    check(maq_source_create(context.get(), uri.c_str(), config, &made));
    owner_.reset(made);
  }

  maq_source* get() const { return owner_.get(); }

  maq_source_info info() const {
    maq_source_info info{};
    info.struct_size = sizeof info;
    check(maq_source_get_info(get(), &info));
    return info;
  }

  // Returns nothing when they are unknown. Frames of the source carry them, too.
  std::optional<maq_intrinsics> intrinsics() const {
    maq_intrinsics intrinsics{};
    const maq_status status = maq_source_get_intrinsics(get(), &intrinsics);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return intrinsics;
  }

  // Returns nothing when the camera does not have the control.
  std::optional<maq_source_control_info> control(maq_source_control which) const {
    maq_source_control_info info{};
    info.struct_size = sizeof info;
    const maq_status status = maq_source_get_control(get(), which, &info);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return info;
  }
  void set_control(maq_source_control which, double value) { check(maq_source_set_control(get(), which, value)); }

  void seek(int64_t time_ns) { check(maq_source_seek(get(), time_ns)); }

  // Returns nothing for sources that are not live. Readable when next() would not wait.
  std::optional<int> event_fd() const {
    int32_t fd = -1;
    const maq_status status = maq_source_get_event_fd(get(), &fd);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return fd;
  }

  // From any thread: next() returns nothing from now on.
  void stop() { check(maq_source_stop(get())); }

  // Returns nothing after the last frame and after stop(). Throws Error with MAQ_TIMEOUT if no frame came in time.
  std::optional<Frame> next(int64_t timeout_ns = MAQ_WAIT_FOREVER) {
    maq_frame* frame = nullptr;
    const maq_status status = maq_source_acquire_frame(get(), timeout_ns, &frame);
    if (status == MAQ_END_OF_STREAM || status == MAQ_CANCELLED) return std::nullopt;
    check(status);
    return Frame(frame);
  }

 private:
  Owner<maq_source, maq_source_destroy> owner_;
};

class Recorder {
 public:
  // `source` and `config` may be NULL.
  Recorder(const Context& context, const std::string& path, const Source* source = nullptr,
           const maq_recorder_config* config = nullptr) {
    maq_recorder* made = nullptr;
    const maq_source* from = source == nullptr ? nullptr : source->get();
    check(maq_recorder_create(context.get(), path.c_str(), from, config, &made));
    owner_.reset(made);
  }

  maq_recorder* get() const { return owner_.get(); }
  void add(const Frame& frame) { check(maq_recorder_add_frame(get(), frame.get())); }
  void finish() { check(maq_recorder_finish(get())); }

  maq_recorder_info info() const {
    maq_recorder_info info{};
    info.struct_size = sizeof info;
    check(maq_recorder_get_info(get(), &info));
    return info;
  }

 private:
  Owner<maq_recorder, maq_recorder_destroy> owner_;
};

class Clip {
 public:
  Clip(const Context& context, const std::string& path, double fps) {
    maq_clip* made = nullptr;
    check(maq_clip_create(context.get(), path.c_str(), fps, &made));
    owner_.reset(made);
  }

  maq_clip* get() const { return owner_.get(); }
  void add(const Frame& frame) { check(maq_clip_add_frame(get(), frame.get())); }
  void finish() { check(maq_clip_finish(get())); }

 private:
  Owner<maq_clip, maq_clip_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_SOURCE_HPP_
