#include "output/output_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const fs::path& path, const std::string& reason) {
  throw std::runtime_error(path.string() + " cannot be written: " + reason + ".");
}

}  // namespace

void make_folder_of(const fs::path& path) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  if (error) fail(path, error.message());
}

OutputFile::OutputFile(fs::path path) : path_(std::move(path)) {
  make_folder_of(path_);
  temporary_path_ = path_.parent_path() / ("." + path_.filename().string() + ".part" + std::to_string(getpid()));
}

OutputFile::~OutputFile() {
  std::error_code ignored;
  if (!committed_) fs::remove(temporary_path_, ignored);
}

void OutputFile::commit() {
  std::error_code error;
  fs::rename(temporary_path_, path_, error);
  if (error) fail(path_, error.message());
  committed_ = true;
}

void write_whole_file(const fs::path& path, const void* bytes, size_t size_bytes) {
  OutputFile output(path);
  FILE* file = std::fopen(output.temporary_path().c_str(), "wb");
  if (file == nullptr) fail(path, std::strerror(errno));
  const bool written = std::fwrite(bytes, 1, size_bytes, file) == size_bytes;
  const int reason = errno;
  if (std::fclose(file) != 0 || !written) fail(path, std::strerror(written ? errno : reason));
  output.commit();
}
