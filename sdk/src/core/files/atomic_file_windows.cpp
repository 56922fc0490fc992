#include "core/files/atomic_file.h"

#include <fcntl.h>
#include <io.h>
#include <sys/stat.h>
#include <windows.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/error.h"
#include "core/files/file_calls.h"
#include "core/files/random_digits.h"
#include "core/wide_path.h"

namespace maq {

// Files alone: pipes and devices have no names here that a user would write to.
AtomicFile::AtomicFile(std::string path, const char* temporary_extension) : path_(std::move(path)), target_(path_) {
  const DWORD attributes = ::GetFileAttributesW(wide_path(path_).c_str());
  constexpr DWORD kNoFile = FILE_ATTRIBUTE_DIRECTORY | FILE_ATTRIBUTE_DEVICE;
  if (attributes != INVALID_FILE_ATTRIBUTES && (attributes & kNoFile) != 0) {
    throw Error(MAQ_ERROR_UNWRITABLE, path_, " exists and is not a file; give another name.");
  }
  make_temporary_file(temporary_extension, _S_IREAD | _S_IWRITE);
}

void AtomicFile::make_temporary_file(const char* extension, mode_t mode) {
  // A file's name may be as long as the file system allows.
  constexpr size_t kMaxName = 200;
  const size_t begin = target_.find_last_of("/\\") + 1;
  const std::string start = target_.substr(0, std::min(target_.size(), begin + kMaxName)) + ".part-";
  do {
    temporary_path_ = start + random_digits() + extension;
    file_ = UniqueFd(::_wopen(wide_path(temporary_path_).c_str(),
                              _O_RDWR | _O_CREAT | _O_EXCL | _O_BINARY | _O_NOINHERIT, int(mode)));
  } while (!file_.is_open() && errno == EEXIST);
  if (!file_.is_open()) fail(" cannot be made: ", errno);
}

AtomicFile::~AtomicFile() {
  if (!file_.is_open()) return;
  file_.reset();
  remove_file(temporary_path_);
}

void AtomicFile::fail(const char* what, int reason) const {
  throw Error(MAQ_ERROR_UNWRITABLE, path_, what, std::strerror(reason), ".");
}

void AtomicFile::write_at(uint64_t offset, const void* bytes, size_t count) {
  if (::_lseeki64(file_.get(), int64_t(offset), SEEK_SET) < 0 || !write_parts(file_.get(), bytes, count, nullptr, 0)) {
    fail(" cannot be written: ", errno);
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
  file_.reset();  // an open file gets no other name
  if (::MoveFileExW(wide_path(temporary_path_).c_str(), wide_path(target_).c_str(),
                    MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) == 0) {
    const DWORD reason = ::GetLastError();
    remove_file(temporary_path_);
    throw Error(MAQ_ERROR_UNWRITABLE, path_, " cannot be replaced (error ", reason,
                " of Windows); does another program have it open?");
  }
}

}  // namespace maq
