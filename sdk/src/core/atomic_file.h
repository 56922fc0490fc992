// A file that appears whole or not at all: written beside its place and renamed when it is complete and on the disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace maq {

class NewFile {
 public:
  // Throws MAQ_ERROR_UNWRITABLE where the folder is not there or may not be written to, and where `path` is something other
  // than a file. `temporary_ending` is that of the temporary name, for those who go by it.
  explicit NewFile(std::string path, const char* temporary_ending = "");
  // Removes what was written, unless commit() was called. What a process leaves behind that dies before is named like the
  // file, with ".part" and a number at the end.
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  const std::string& path() const { return path_; }
  // For a library that opens files by name: it writes here instead of append(), and is done before commit().
  const std::string& temporary_path() const { return temporary_path_; }
  uint64_t size_bytes() const { return size_bytes_; }

  // At the end. Throws MAQ_ERROR_UNWRITABLE: the disk is full.
  void append(const void* bytes, size_t count);
  // Over what was appended already. Likewise.
  void overwrite(uint64_t offset, const void* bytes, size_t count);

  // Takes the place of a file that is there. Throws MAQ_ERROR_UNWRITABLE; then that file is as it was.
  void commit();

 private:
  void write_at(uint64_t offset, const void* bytes, size_t count);
  [[noreturn]] void fail(const char* what, int reason) const;

  std::string path_, temporary_path_;
  int file_ = -1;
  uint64_t size_bytes_ = 0;
};

}  // namespace maq
