#include "image/clips/clip_reader.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#include "core/error.h"

extern char** environ;

namespace maq {
namespace {

// Containers and raw streams of clips. Others, such as lists of files, would open more than the file.
constexpr char kFormats[] =
    "mov,matroska,avi,mpegts,mpeg,mpegvideo,flv,asf,ogg,ivf,h264,hevc,m4v,mjpeg,nut,yuv4mpegpipe,dv,mxf,rm";
constexpr char kUnknownTimeBase[] = "nvalid time base";  // in the program's messages
constexpr size_t kTextBytes = 16 << 10;
constexpr size_t kProblemBytes = 200;
constexpr rlim_t kProgramBytes = rlim_t(1) << 30;  // more than it takes

[[noreturn]] void fail_to_start(const std::string& path, const char* program, int reason) {
  if (reason == ENOMEM) throw std::bad_alloc();
  if (reason == ENOENT || reason == EACCES) {
    throw Error(
        MAQ_ERROR_RUNTIME_LIBRARY, path, " needs the program ", program,
        ", which is not there. Install it (Debian: apt install ffmpeg; Python: pip install 'maquette[clips]'), or "
        "set MAQ_FFMPEG to its path.");
  }
  throw Error(MAQ_ERROR_OUT_OF_MEMORY, path, " cannot be decoded: the program ", program, " does not start (",
              std::strerror(reason), "); close files or end other programs.");
}

// Settings of posix_spawn(): no input, images to the pipe, messages to a file in memory, in a group of its own, so that
// Ctrl-C is left to the app.
class SpawnSettings {
 public:
  SpawnSettings(int images, int messages) {
    if (posix_spawn_file_actions_init(&actions) != 0) throw std::bad_alloc();
    if (posix_spawnattr_init(&attributes) != 0) {
      posix_spawn_file_actions_destroy(&actions);
      throw std::bad_alloc();
    }
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, images, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, messages, STDERR_FILENO);
    sigset_t signals;
    sigfillset(&signals);
    posix_spawnattr_setsigdefault(&attributes, &signals);
    sigemptyset(&signals);
    posix_spawnattr_setsigmask(&attributes, &signals);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
  }
  ~SpawnSettings() {
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
};

std::string text_at(int file, off_t offset) {
  std::string text(kTextBytes, '\0');
  text.resize(size_t(std::max<ssize_t>(::pread(file, text.data(), text.size(), offset), 0)));
  return text;
}

// From "Duration: 00:00:01.60" of the program's messages; 0 where it says "N/A".
double duration_in(const std::string& text) {
  constexpr char kWord[] = "Duration: ";
  const size_t at = text.find(kWord);
  int hours = 0, minutes = 0, seconds = 0, hundredths = 0;
  if (at == std::string::npos ||
      std::sscanf(text.c_str() + at + sizeof kWord - 1, "%d:%d:%d.%d", &hours, &minutes, &seconds, &hundredths) != 4) {
    return 0;
  }
  return hours * 3600.0 + minutes * 60 + seconds + hundredths * 0.01;
}

// Returns the last error in the program's messages, "[mov @ 0x5581] [error] moov atom not found", without its labels.
// `input` is left out at its beginning. The text is of a stranger's file: it is short and has printable characters
// only.
std::string last_error_in(const std::string& text, const std::string& input) {
  size_t start = std::string::npos;
  for (const char* label : {"[error] ", "[fatal] ", "[panic] "}) {
    const size_t found = text.rfind(label);
    if (found == std::string::npos) continue;
    const size_t after = found + std::strlen(label);
    if (start == std::string::npos || after > start) start = after;
  }
  if (start == std::string::npos) return "";
  std::string problem = text.substr(start, text.find('\n', start) - start);
  if (problem.rfind(input + ": ", 0) == 0) problem.erase(0, input.size() + 2);
  problem.resize(std::min(problem.size(), kProblemBytes));
  for (char& letter : problem) {
    if (letter < ' ' || letter > '~') letter = '?';
  }
  return problem;
}

}  // namespace

ClipReader::ClipReader(const std::string& path, double start_s) {
  // The file's time base, so that times stay exact: its name in old and in new versions of FFmpeg.
  static constexpr const char* kTimeBases[] = {"-1", "demux"};
  static std::atomic<int> known{0};
  const int first = known;
  if (start(path, start_s, kTimeBases[first])) return;
  if (start(path, start_s, kTimeBases[1 - first])) known = 1 - first;
}

bool ClipReader::start(const std::string& path, double start_s, const char* time_base) {
  const char* const named = std::getenv("MAQ_FFMPEG");
  const std::string program = named != nullptr && *named != '\0' ? named : "ffmpeg";
  int ends[2] = {-1, -1};
  if (::pipe2(ends, O_CLOEXEC) != 0) fail_to_start(path, program.c_str(), errno);
  images_.reset(ends[0]);
  UniqueFd write_end(ends[1]);
  ::fcntl(images_.get(), F_SETPIPE_SZ, 1 << 20);  // fewer switches between both processes; not needed
  messages_.reset(::memfd_create("maquette-ffmpeg", MFD_CLOEXEC));
  if (!messages_.is_open()) fail_to_start(path, program.c_str(), errno);
  input_ = "file:" + path;  // never an address
  char start[32];
  const long long start_us = std::max(0LL, std::llround(start_s * 1e6));
  std::snprintf(start, sizeof start, "%lld.%06lld", start_us / 1000000, start_us % 1000000);
  std::vector<const char*> arguments = {
      program.c_str(),     "-nostdin", "-nostats", "-hide_banner",   "-loglevel",           "level+info",
      "-threads",          "2",        "-copyts",  "-start_at_zero", "-protocol_whitelist", "file",
      "-format_whitelist", kFormats};
  if (start_us > 0) arguments.insert(arguments.end(), {"-ss", start});
  arguments.insert(arguments.end(), {"-i", input_.c_str(), "-map", "0:V:0", "-c:v", "rawvideo", "-pix_fmt", "bgr24",
                                     "-enc_time_base", time_base, "-f", "nut", "pipe:1", nullptr});
  const SpawnSettings settings(write_end.get(), messages_.get());
  const int error = ::posix_spawnp(&process_.id, program.c_str(), &settings.actions, &settings.attributes,
                                   const_cast<char* const*>(arguments.data()), environ);
  if (error != 0) {
    process_.id = -1;
    fail_to_start(path, program.c_str(), error);
  }
  write_end.reset();
  stream_ = std::make_unique<NutStream>(images_.get());
  duration_s_ = duration_in(text_at(messages_.get(), 0));
  return stream_->is_open() || end_of_program().find(kUnknownTimeBase) == std::string::npos;
}

std::string ClipReader::end_of_program() {
  images_.reset();
  const int status = process_.wait();
  const off_t end = ::lseek(messages_.get(), 0, SEEK_END);
  const std::string text = text_at(messages_.get(), std::max<off_t>(end - off_t(kTextBytes), 0));
  // Under a limit of memory its words say many things.
  rlimit limit{};
  const bool is_limited = ::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur < kProgramBytes;
  if (says_out_of_memory(text) || (is_limited && (!WIFEXITED(status) || WEXITSTATUS(status) != 0))) {
    throw std::bad_alloc();
  }
  problem_ = last_error_in(text, input_);
  return text;
}

ClipReader::Process::~Process() {
  // An app that waits for all children may have taken it already: then its number may be another program's.
  int status = 0;
  if (id < 0 || ::waitpid(id, &status, WNOHANG) != 0) return;
  ::kill(id, SIGKILL);
  wait();
}

int ClipReader::Process::wait() {
  int status = 0;
  while (id >= 0 && ::waitpid(id, &status, 0) < 0 && errno == EINTR) {
  }
  id = -1;
  return status;
}

bool ClipReader::read(ImageView& image, int64_t& time_ns) {
  if (!has_frames() || !images_.is_open()) return false;
  if (!stream_->read(pixels_, time_ns)) {
    end_of_program();
    return false;
  }
  image = packed_view(MAQ_PIXEL_BGR8, width_px(), height_px(), pixels_.data());
  return true;
}

}  // namespace maq
