// A file that is written atomically: under a temporary name, and renamed when it is complete and on the disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/unique_fd.h"

namespace maq {

class AtomicFile {
 public:
  // Throws MAQ_ERROR_UNWRITABLE where the folder does not exist or may not be written to, and where `path` is something
  // other than a file. `temporary_extension` ends the temporary name, for libraries that choose a format by it.
  explicit AtomicFile(std::string path, const char* temporary_extension = "");
  // Removes what was written, unless commit() was called. A process that dies before leaves the temporary file behind:
  // its name is that of the file with ".part" and two numbers.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::string& path() const { return path_; }
  // For a library that opens files by name: it writes here in place of append(), and finishes before commit().
  const std::string& temporary_path() const { return temporary_path_; }
  uint64_t size_bytes() const { return size_bytes_; }

  // Writes at the end. Throws MAQ_ERROR_UNWRITABLE, as on a full disk.
  void append(const void* bytes, size_t count);
  // Replaces bytes that were appended before. Throws likewise.
  void overwrite(uint64_t offset, const void* bytes, size_t count);

  // Gives the file its name, in place of one that has it. Throws MAQ_ERROR_UNWRITABLE; then the old file is unchanged.
  void commit();

 private:
  void write_at(uint64_t offset, const void* bytes, size_t count);
  [[noreturn]] void fail(const char* what, int reason) const;

  std::string path_, temporary_path_;
  UniqueFd file_;
  uint64_t size_bytes_ = 0;
};

}  // namespace maq
