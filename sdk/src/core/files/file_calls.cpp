#include "core/files/file_calls.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "core/files/blocked_write_signals.h"

namespace maq {

int make_new_file(const std::string& path) {
  return ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
}

void remove_file(const std::string& path) { ::unlink(path.c_str()); }

ptrdiff_t read_at(int file, uint64_t offset, void* bytes, size_t count) {
  for (;;) {
    const ssize_t got = ::pread(file, bytes, count, off_t(offset));
    if (got >= 0 || errno != EINTR) return got;
  }
}

bool write_parts(int file, const void* first, size_t first_bytes, const void* second, size_t second_bytes) {
  const BlockedWriteSignals blocked;
  iovec parts[2] = {{const_cast<void*>(first), first_bytes}, {const_cast<void*>(second), second_bytes}};
  iovec* part = parts;
  int left = 2;
  while (left > 0) {
    if (part->iov_len == 0) {
      ++part;
      --left;
      continue;
    }
    ssize_t written = ::writev(file, part, left);
    if (written < 0 && errno == EINTR) continue;
    if (written == 0) errno = ENOSPC;
    if (written <= 0) return false;
    for (int i = 0; i < left && written > 0; ++i) {
      const size_t done = std::min(size_t(written), part[i].iov_len);
      part[i].iov_base = static_cast<uint8_t*>(part[i].iov_base) + done;
      part[i].iov_len -= done;
      written -= ssize_t(done);
    }
  }
  return true;
}

bool cut_file(int file, uint64_t size_bytes) {
  return ::ftruncate(file, off_t(size_bytes)) == 0 && ::lseek(file, off_t(size_bytes), SEEK_SET) >= 0;
}

bool synchronise(int file) { return ::fsync(file) == 0 || errno == EINVAL || errno == EROFS || errno == ENOTSUP; }

uint64_t next_data(int file, uint64_t offset) {
  const off_t data = ::lseek(file, off_t(offset), SEEK_DATA);
  if (data < 0) return errno == ENXIO ? UINT64_MAX : offset;
  return uint64_t(data);
}

std::shared_ptr<const uint8_t> map_file(int file, size_t size_bytes) {
  void* const at = ::mmap(nullptr, size_bytes, PROT_READ, MAP_SHARED, file, 0);
  if (at == MAP_FAILED) return nullptr;
  return {static_cast<const uint8_t*>(at),
          [size_bytes](const uint8_t* from) { ::munmap(const_cast<uint8_t*>(from), size_bytes); }};
}

}  // namespace maq
