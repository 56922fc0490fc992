#include "core/files/file.h"

#include <fcntl.h>
#include <io.h>
#include <windows.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/error.h"
#include "core/files/file_calls.h"
#include "core/wide_path.h"

namespace maq {
namespace {

constexpr size_t kBlockBytes = 1 << 16;

std::string in_units(uint64_t bytes) {
  if (bytes % (1 << 30) == 0) return concatenate(bytes >> 30, " GiB");
  if (bytes % (1 << 20) == 0) return concatenate(bytes >> 20, " MiB");
  return concatenate(bytes, " bytes");
}

DWORD attributes_of(const std::string& path) { return ::GetFileAttributesW(wide_path(path).c_str()); }

}  // namespace

bool file_exists(const std::string& path) {
  const DWORD attributes = attributes_of(path);
  return attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY) == 0;
}

bool is_folder(const std::string& path) {
  const DWORD attributes = attributes_of(path);
  return attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
}

// Also refuses what begins at a drive ("C:"), and parts behind a backslash.
bool stays_inside(const std::string& relative_path) {
  if (relative_path.empty() || relative_path[0] == '/') return false;
  if (relative_path.find_first_of(std::string("\0\\:", 3)) != std::string::npos) return false;
  const std::string parts = "/" + relative_path + "/";
  return parts.find("/../") == std::string::npos;
}

OpenFile open_file(const std::string& path) {
  if (is_folder(path)) throw Error(MAQ_ERROR_UNREADABLE, path, " is not a file but a folder.");
  OpenFile file{UniqueFd(::_wopen(wide_path(path).c_str(), _O_RDONLY | _O_BINARY | _O_NOINHERIT)), 0};
  if (!file.fd.is_open() && errno == ENOENT) {
    throw Error(MAQ_ERROR_NOT_FOUND, path, " does not exist; check the path.");
  }
  if (!file.fd.is_open()) throw Error(MAQ_ERROR_UNREADABLE, path, " cannot be opened (", std::strerror(errno), ").");
  const auto handle = reinterpret_cast<HANDLE>(::_get_osfhandle(file.fd.get()));
  LARGE_INTEGER size{};
  if (::GetFileType(handle) != FILE_TYPE_DISK || ::GetFileSizeEx(handle, &size) == 0) {
    throw Error(MAQ_ERROR_UNREADABLE, path, " is not a file but a pipe or a device.");
  }
  file.size_bytes = uint64_t(size.QuadPart);
  return file;
}

std::vector<uint8_t> read_file(const std::string& path, uint64_t max_bytes, const StartCheck& check_start) {
  const OpenFile file = open_file(path);
  if (file.size_bytes > max_bytes) {
    throw Error(MAQ_ERROR_UNREADABLE, path, " is over ", in_units(max_bytes),
                ", the limit here; is it the right file?");
  }
  std::vector<uint8_t> bytes(size_t(file.size_bytes));
  bool is_checked = !check_start;
  for (size_t done = 0; done < bytes.size();) {
    const ptrdiff_t got = read_at(file.fd.get(), done, &bytes[done], std::min(kBlockBytes, bytes.size() - done));
    if (got <= 0) {
      throw Error(MAQ_ERROR_UNREADABLE, path, " cannot be read to its end; did it change meanwhile?");
    }
    done += size_t(got);
    if (is_checked || done < kBlockBytes) continue;
    check_start({bytes.begin(), bytes.begin() + ptrdiff_t(done)});
    is_checked = true;
  }
  if (!is_checked) check_start(bytes);
  return bytes;
}

}  // namespace maq
