#include "core/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "core/error.h"

namespace maq {
namespace {

std::string folder_of(const std::string& path) {
  const size_t slash = path.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

// False where the data is not on the disk. File systems without fsync() have done what they can.
bool synchronise(int file) { return ::fsync(file) == 0 || errno == EINVAL || errno == EROFS || errno == ENOTSUP; }

}  // namespace

AtomicFile::AtomicFile(std::string path, const char* temporary_extension) : path_(std::move(path)) {
  struct stat found {};
  if (::stat(path_.c_str(), &found) == 0 && !S_ISREG(found.st_mode)) {
    throw Error(MAQ_ERROR_UNWRITABLE, path_, " exists and is not a file; give another name.");
  }
  static std::atomic<unsigned> count{0};
  do {
    temporary_path_ =
        path_ + ".part" + std::to_string(::getpid()) + "-" + std::to_string(++count) + temporary_extension;
    file_ = UniqueFd(::open(temporary_path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
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
  write_at(size_bytes_, bytes, count);
  size_bytes_ += count;
}

void AtomicFile::overwrite(uint64_t offset, const void* bytes, size_t count) {
  if (offset > size_bytes_ || count > size_bytes_ - offset) {
    throw Error(MAQ_ERROR_INTERNAL, path_, ": bytes ", offset, " to ", offset + count, " were not written before.");
  }
  write_at(offset, bytes, count);
}

void AtomicFile::commit() {
  // Without it a crash could leave the new name with none of its bytes.
  if (!synchronise(file_.get())) fail(" did not reach the disk: ", errno);
  if (std::rename(temporary_path_.c_str(), path_.c_str()) != 0) fail(" cannot be replaced: ", errno);
  file_.reset();
  // The name too; where that fails, a crash leaves either the old file or the new one.
  const UniqueFd folder(::open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.is_open()) synchronise(folder.get());
}

}  // namespace maq
