// Reads video files of any kind by the program ffmpeg.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/files/unique_fd.h"
#include "core/frame.h"
#include "image/clips/nut_stream.h"

namespace maq {

class ClipReader {
 public:
  // Starts the program: the one that MAQ_FFMPEG names, otherwise `ffmpeg` of the PATH. The first frame is the first at
  // `start_s` or later. Throws MAQ_ERROR_RUNTIME_LIBRARY where there is none, MAQ_ERROR_UNSUPPORTED on Android.
  explicit ClipReader(const std::string& path, double start_s = 0);
  // False where it has no frame (from `start_s` on) that can be decoded.
  bool has_frames() const { return stream_ != nullptr && stream_->is_open(); }
  int width_px() const { return stream_->width_px(); }
  int height_px() const { return stream_->height_px(); }
  double fps() const { return stream_->fps(); }      // as the file says, unchecked; 0: not known
  double duration_s() const { return duration_s_; }  // as the file says, to 0.01 s; 0: not known

  // The next frame, BGR8, valid until the next call, and its presentation time. False after the last that can be
  // decoded.
  bool read(ImageView& image, int64_t& time_ns);

  // After the last frame, or without any: the last error of the program, up to 200 printable characters; "": none.
  const std::string& problem() const { return problem_; }

 private:
  // Starts the program. Returns false if it does not know `time_base`.
  bool start(const std::string& path, double start_s, const char* time_base);
  // Waits for the end of the program, and returns its last messages. Throws std::bad_alloc if it ended for lack of
  // memory. It must have closed the pipe.
  std::string end_of_program();

  // Ends with its owner.
  struct Process {
    ~Process();  // NOLINT(performance-trivially-destructible): it does nothing on Android alone
    int wait();
    pid_t id = -1;
  };

  std::string input_, problem_;
  Process process_;  // ended after its pipe is closed
  UniqueFd images_, messages_;
  std::unique_ptr<NutStream> stream_;
  double duration_s_ = 0;
  std::vector<uint8_t> pixels_;
};

}  // namespace maq
