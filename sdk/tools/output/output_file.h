// Files that appear atomically: written under another name and renamed when complete.
#pragma once

#include <cstddef>
#include <filesystem>

// Makes the folder of `path` when it is not there. Throws std::runtime_error.
void make_folder_of(const std::filesystem::path& path);

class OutputFile {
 public:
  // Makes the folder of `path` when it is not there.
  explicit OutputFile(std::filesystem::path path);
  // Removes what was written unless commit() was called.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // Where to write.
  const std::filesystem::path& temporary_path() const { return temporary_path_; }
  // Gives the file its final name, replacing one that was there. Throws std::runtime_error.
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_path_;
  bool committed_ = false;
};

// Writes all bytes to a new file at `path`. Throws std::runtime_error, for example when the disk is full.
void write_whole_file(const std::filesystem::path& path, const void* bytes, size_t size_bytes);
