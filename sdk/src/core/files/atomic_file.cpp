#include "core/files/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <climits>
#include <cstring>
#include <string_view>
#include <thread>

#include "core/error.h"
#include "core/files/blocked_write_signals.h"
#include "core/files/file_calls.h"
#include "core/files/random_digits.h"

namespace maq {
namespace {

constexpr mode_t kNewFile = 0644, kPermissions = 0777, kOwner = S_IRUSR | S_IWUSR;
// How long a pipe waits for its reader, which may have been started together with this process.
constexpr std::chrono::seconds kPatience{2};

std::string folder_of(const std::string& path) {
  const size_t slash = path.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

// 3 of /dev/fd/3: an open descriptor, which has no name to rename to, even where it is one of a file; -1 of others.
int descriptor_of(std::string_view path) {
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (path.substr(0, folder.size()) != folder) continue;
    int number = -1;
    const char* const end = path.data() + path.size();
    const auto [last, error] = std::from_chars(path.data() + folder.size(), end, number);
    if (error == std::errc() && last == end) return number;
  }
  return -1;
}

// Returns the target of the path, which need not exist yet.
std::string without_links(std::string path) {
  constexpr int kMaxLinks = 40;  // limit of the kernel; stat() has refused more
  char link[PATH_MAX];
  for (int links = 0; links < kMaxLinks && descriptor_of(path) < 0; ++links) {
    const ssize_t length = ::readlink(path.c_str(), link, sizeof link);
    if (length <= 0) break;
    path = (link[0] == '/' ? "" : folder_of(path) + "/") + std::string(link, size_t(length));
  }
  return path;
}

}  // namespace

AtomicFile::AtomicFile(std::string path, const char* temporary_extension) : path_(std::move(path)) {
  struct stat found {};
  const bool exists = ::stat(path_.c_str(), &found) == 0;
  // A link that may not be followed, as one of another user's in /tmp, is not followed by hand either.
  if (!exists && errno != ENOENT) fail(" cannot be made: ", errno);
  target_ = without_links(path_);
  is_stream_ = exists && (descriptor_of(target_) >= 0 || S_ISCHR(found.st_mode) || S_ISFIFO(found.st_mode));
  if (exists && (is_stream_ ? *temporary_extension != '\0' : !S_ISREG(found.st_mode))) {
    throw Error(MAQ_ERROR_UNWRITABLE, path_, " exists and is not a file; give another name.");
  }
  if (!is_stream_)
    make_temporary_file(temporary_extension, exists ? (found.st_mode & kPermissions) | kOwner : kNewFile);
}

void AtomicFile::make_temporary_file(const char* extension, mode_t mode) {
  // A file's name may be as long as the file system allows.
  constexpr size_t kMaxName = 200;
  const size_t begin = target_.rfind('/') + 1;
  const std::string start = target_.substr(0, std::min(target_.size(), begin + kMaxName)) + ".part-";
  do {
    temporary_path_ = start + random_digits() + extension;
    file_ = UniqueFd(::open(temporary_path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  } while (!file_.is_open() && errno == EEXIST);
  if (!file_.is_open()) fail(" cannot be made: ", errno);
}

AtomicFile::~AtomicFile() {
  if (file_.is_open()) ::unlink(temporary_path_.c_str());
}

void AtomicFile::fail(const char* what, int reason) const {
  throw Error(MAQ_ERROR_UNWRITABLE, path_, what, std::strerror(reason), ".");
}

void AtomicFile::write_at(uint64_t offset, const void* bytes, size_t count) {
  const BlockedWriteSignals blocked;
  const auto* from = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t written = ::pwrite(file_.get(), from, std::min(count, size_t(1) << 30), off_t(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(" cannot be written: ", written < 0 ? errno : ENOSPC);
    from += written;
    offset += uint64_t(written);
    count -= size_t(written);
  }
}

void AtomicFile::append(const void* bytes, size_t count) {
  if (is_stream_) {
    const auto* from = static_cast<const uint8_t*>(bytes);
    stream_bytes_.insert(stream_bytes_.end(), from, from + count);
  } else {
    write_at(size_bytes_, bytes, count);
  }
  size_bytes_ += count;
}

void AtomicFile::overwrite(uint64_t offset, const void* bytes, size_t count) {
  if (offset > size_bytes_ || count > size_bytes_ - offset) {
    throw Error(MAQ_ERROR_INTERNAL, path_, ": bytes ", offset, " to ", offset + count, " were not written before.");
  }
  if (is_stream_) {
    std::copy_n(static_cast<const uint8_t*>(bytes), count, stream_bytes_.begin() + ptrdiff_t(offset));
  } else {
    write_at(offset, bytes, count);
  }
}

UniqueFd AtomicFile::open_stream() const {
  const int descriptor = descriptor_of(target_);
  if (descriptor >= 0) return UniqueFd(::fcntl(descriptor, F_DUPFD_CLOEXEC, 0));
  const auto end = std::chrono::steady_clock::now() + kPatience;
  for (;;) {
    UniqueFd stream(::open(target_.c_str(), O_WRONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (stream.is_open()) {
      ::fcntl(stream.get(), F_SETFL, O_WRONLY);  // writes wait again
      return stream;
    }
    struct stat found {};
    const int reason = errno;
    const bool waits = reason == ENXIO && ::stat(target_.c_str(), &found) == 0 && S_ISFIFO(found.st_mode);
    if (waits && std::chrono::steady_clock::now() >= end) {
      throw Error(MAQ_ERROR_UNWRITABLE, path_, " is a pipe that no program reads; start its reader first.");
    }
    if (!waits && reason != EINTR) fail(" cannot be opened: ", reason);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

void AtomicFile::write_stream() const {
  const BlockedWriteSignals blocked;
  const UniqueFd stream = open_stream();
  if (!stream.is_open()) fail(" cannot be opened: ", errno);
  for (size_t at = 0; at < stream_bytes_.size();) {
    const ssize_t written = ::write(stream.get(), &stream_bytes_[at], stream_bytes_.size() - at);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(" cannot be written: ", written < 0 ? errno : ENOSPC);
    at += size_t(written);
  }
}

void AtomicFile::commit() {
  if (is_stream_) return write_stream();
  // Without it a crash could leave the new name with none of its bytes.
  if (!synchronise(file_.get())) fail(" did not reach the disk: ", errno);
  if (std::rename(temporary_path_.c_str(), target_.c_str()) != 0) fail(" cannot be replaced: ", errno);
  file_.reset();
  // The name too; where that fails, a crash leaves either the old file or the new one.
  const UniqueFd folder(::open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.is_open()) synchronise(folder.get());
}

}  // namespace maq
