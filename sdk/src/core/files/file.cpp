#include "core/files/file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/clock.h"
#include "core/error.h"

namespace maq {
namespace {

constexpr size_t kBlockBytes = 1 << 16;

// Who writes to a pipe opens it soon, but may wait for a network before there is something to write.
constexpr std::chrono::seconds kWaitForWriter(3), kWaitForBytes(10);

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "folder";
  if (S_ISFIFO(mode)) return "pipe";
  if (S_ISSOCK(mode)) return "socket";
  return "device";
}

// Whether errno says that there is no such file.
bool is_missing() { return errno == ENOENT || errno == ENOTDIR; }

// Looks before it opens: some devices act when they are opened. Without O_NONBLOCK, a pipe would wait for its writer.
UniqueFd open_to_read(const std::string& path, bool takes_pipes, struct stat& status) {
  const auto is_taken = [&] { return S_ISREG(status.st_mode) || (takes_pipes && S_ISFIFO(status.st_mode)); };
  UniqueFd file;
  bool is_there = ::stat(path.c_str(), &status) == 0;
  if (is_there && is_taken()) {
    file.reset(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    is_there = file.is_open() && ::fstat(file.get(), &status) == 0;
  }
  if (!is_there && is_missing()) throw Error(MAQ_ERROR_NOT_FOUND, path, " does not exist; check the path.");
  if (!is_there) throw Error(MAQ_ERROR_UNREADABLE, path, " cannot be opened (", std::strerror(errno), ").");
  if (!is_taken()) throw Error(MAQ_ERROR_UNREADABLE, path, " is not a file but a ", kind_of(status.st_mode), ".");
  return file;
}

std::string in_units(uint64_t bytes) {
  if (bytes % (1 << 30) == 0) return concatenate(bytes >> 30, " GiB");
  if (bytes % (1 << 20) == 0) return concatenate(bytes >> 20, " MiB");
  return concatenate(bytes, " bytes");
}

// Waits for bytes of a pipe or for its end.
bool wait_for_bytes(int fd, MonotonicClock::time_point deadline) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - MonotonicClock::now()).count();
    pollfd pipe{fd, POLLIN, 0};
    const int ready = ::poll(&pipe, 1, int(std::max<int64_t>(left, 0)));
    if (ready >= 0 || errno != EINTR) return ready > 0;
  }
}

// A file or a pipe from front to back.
class ByteStream {
 public:
  explicit ByteStream(const std::string& path) : path_(path) {
    struct stat status {};
    file_ = open_to_read(path, /*takes_pipes=*/true, status);
    is_pipe_ = S_ISFIFO(status.st_mode);
    size_bytes_ = is_pipe_ ? 0 : uint64_t(status.st_size);
  }

  uint64_t size_bytes() const { return size_bytes_; }  // 0: not known

  // 0 at the end. Throws MAQ_ERROR_UNREADABLE, also when no byte comes in time.
  size_t read(uint8_t* block, size_t count) {
    auto deadline = MonotonicClock::now() + (has_writer_ ? kWaitForBytes : kWaitForWriter);
    for (;;) {
      const ssize_t got = ::read(file_.get(), block, count);
      if (got < 0 && errno == EINTR) continue;
      const bool has_none_yet = is_pipe_ && (got == 0 ? !has_writer_ : got < 0 && errno == EAGAIN);
      if (got < 0 && !has_none_yet) {
        throw Error(MAQ_ERROR_UNREADABLE, path_, " cannot be read to its end (", std::strerror(errno), ").");
      }
      if (got > 0) has_writer_ = true;
      if (!has_none_yet) return size_t(got);
      // EAGAIN: there is a writer.
      if (got < 0 && !std::exchange(has_writer_, true)) {
        deadline = MonotonicClock::now() + kWaitForBytes;
      } else if (MonotonicClock::now() >= deadline) {
        throw Error(MAQ_ERROR_UNREADABLE, path_, " is a pipe ",
                    has_writer_ ? "into which nothing was written for " : "that no program opened to write for ",
                    (has_writer_ ? kWaitForBytes : kWaitForWriter).count(), " s; start the program that writes first.");
      }
      has_writer_ |= wait_for_bytes(file_.get(), deadline);
    }
  }

 private:
  const std::string& path_;
  UniqueFd file_;
  bool is_pipe_ = false;
  bool has_writer_ = false;  // or had one
  uint64_t size_bytes_ = 0;
};

}  // namespace

bool file_exists(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && !S_ISDIR(status.st_mode);
}

bool is_folder(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

bool stays_inside(const std::string& relative_path) {
  if (relative_path.empty() || relative_path[0] == '/') return false;
  if (relative_path.find('\0') != std::string::npos) return false;
  const std::string parts = "/" + relative_path + "/";
  return parts.find("/../") == std::string::npos;
}

OpenFile open_file(const std::string& path) {
  struct stat status {};
  OpenFile file{open_to_read(path, /*takes_pipes=*/false, status), 0};
  file.size_bytes = uint64_t(status.st_size);
  return file;
}

std::vector<uint8_t> read_file(const std::string& path, uint64_t max_bytes, const StartCheck& check_start) {
  ByteStream file(path);
  const auto check_size = [&](uint64_t size_bytes) {
    if (size_bytes <= max_bytes) return;
    throw Error(MAQ_ERROR_UNREADABLE, path, " is over ", in_units(max_bytes),
                ", the limit here; is it the right file?");
  };
  check_size(file.size_bytes());
  std::vector<uint8_t> bytes;
  bytes.reserve(size_t(file.size_bytes()));
  uint8_t block[kBlockBytes];
  bool is_checked = !check_start;
  while (const size_t count = file.read(block, sizeof block)) {
    bytes.insert(bytes.end(), block, block + count);
    check_size(bytes.size());
    if (is_checked || bytes.size() < kBlockBytes) continue;
    check_start(bytes);
    is_checked = true;
  }
  if (!is_checked) check_start(bytes);
  return bytes;
}

}  // namespace maq
