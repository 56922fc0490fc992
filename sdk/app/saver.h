// Writes snapshots, clips and recordings into a folder, without holding up the window.
#pragma once

#include <app/rgba_image.h>
#include <memory>
#include <optional>
#include <string>

#include "file_thread.h"
#include "window.h"

class Saver {
 public:
  Saver(const maquette::Context& context, const std::string& folder) : context_(context), folder_(folder) {}

  // `people` may be null.
  void save_snapshot(maquette::RgbaImage image, std::shared_ptr<const maquette::DensePoseResult> people);

  bool has_clip() const { return clip_ != nullptr; }
  // Clips of that part of the window. `fps`: how often images will be added.
  void begin_clip(const Rect& rect, double fps);
  void end_clip();
  // Adds that part of the window; a clip has one size, so it ends when the part gets another.
  void add_to_clip(const Window& window, const Rect& rect);

  // The path of the recording that begins, or "" when one ends: the source is recorded by its pipeline.
  std::string toggle_recording();
  void forget_recording() { recording_.clear(); }  // it ended with its source
  bool is_recording() const { return !recording_.empty(); }

  void run(FileThread::Job job) { files_.add(std::move(job)); }
  // What was saved last, or why it was not, for some seconds.
  std::string message();

 private:
  std::string new_path(const char* extension);

  const maquette::Context& context_;
  const std::string folder_;
  int file_count_ = 0;
  std::string clip_path_, recording_, message_;
  Rect clip_rect_;
  double message_since_s_ = 0;
  std::shared_ptr<std::optional<maquette::Clip>> clip_;  // of the file thread; none before it was made
  FileThread files_;                                     // last: its jobs use the others
};
