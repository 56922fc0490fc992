// Files that are compressed by gzip (RFC 1952), by zlib.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/files/file_reader.h"

namespace maq {

// Decompresses a file from front to back, in memory of fixed size: bytes are made only when they are asked for.
class GzipFile {
 public:
  // Throws the errors of open_file(), and MAQ_ERROR_UNREADABLE for a file that is not compressed by gzip.
  explicit GzipFile(const std::string& path);
  ~GzipFile();

  const FileReader& file() const { return file_; }
  // The most bytes that the whole file can hold, by its size: deflate makes a byte at least 1/1032 byte large.
  uint64_t max_bytes() const { return max_bytes_; }

  // Throws MAQ_ERROR_UNREADABLE when the file ends before or is damaged, and MAQ_ERROR_OUT_OF_MEMORY.
  void read(void* bytes, size_t count);

 private:
  struct Inflation;
  FileReader file_;
  uint64_t max_bytes_;
  std::unique_ptr<Inflation> inflation_;
};

// The bytes as a file that gzip decompresses.
std::vector<uint8_t> gzip_of(const std::vector<uint8_t>& bytes);

}  // namespace maq
