// A file that is written atomically: under a temporary name, and renamed when it is complete and on the disk.
#pragma once

#include <sys/stat.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/files/unique_fd.h"

namespace maq {

class AtomicFile {
 public:
  // Writes to the file behind a symbolic link. Character devices, pipes and descriptors by their name
  // (/dev/stdout, /dev/fd/3) keep their place: they get all bytes at once from commit(). Folders are not made.
  // Throws MAQ_ERROR_UNWRITABLE where the folder does not exist or may not be written to, and where `path` is something
  // else: a folder, a disk. `temporary_extension` ends the temporary name, for libraries that choose a format by it;
  // with one, `path` must be a file.
  explicit AtomicFile(std::string path, const char* temporary_extension = "");
  // Removes the temporary file, unless commit() was called. A process that dies before leaves the temporary file
  // behind: the file's name with ".part-" and 16 random digits.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::string& path() const { return path_; }
  // For a library that opens files by name: it writes here in place of append(), and finishes before commit().
  const std::string& temporary_path() const { return temporary_path_; }
  uint64_t size_bytes() const { return size_bytes_; }

  // Writes at the end. Throws MAQ_ERROR_UNWRITABLE, as on a full disk.
  void append(const void* bytes, size_t count);
  // Replaces bytes that were appended before. Throws MAQ_ERROR_UNWRITABLE.
  void overwrite(uint64_t offset, const void* bytes, size_t count);

  // Gives the file its name, in place of one that has it. Throws MAQ_ERROR_UNWRITABLE; then the old file is unchanged.
  // A pipe waits two seconds for a program that reads it.
  void commit();

 private:
  void make_temporary_file(const char* extension, mode_t mode);
  void write_at(uint64_t offset, const void* bytes, size_t count);
  UniqueFd open_stream() const;
  void write_stream() const;
  [[noreturn]] void fail(const char* what, int reason) const;

  std::string path_;                     // as given
  std::string target_, temporary_path_;  // without links; "" for streams
  bool is_stream_ = false;
  std::vector<uint8_t> stream_bytes_;
  UniqueFd file_;
  uint64_t size_bytes_ = 0;
};

}  // namespace maq
