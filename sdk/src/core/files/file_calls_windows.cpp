#include "core/files/file_calls.h"

#include <fcntl.h>
#include <io.h>
#include <sys/stat.h>
#include <windows.h>

#include <algorithm>
#include <cerrno>

#include "core/wide_path.h"

namespace maq {
namespace {

HANDLE handle_of(int file) { return reinterpret_cast<HANDLE>(::_get_osfhandle(file)); }

bool write_all(int file, const void* bytes, size_t count) {
  constexpr size_t kMaxBytes = size_t(1) << 30;
  const auto* from = static_cast<const char*>(bytes);
  while (count > 0) {
    const int written = ::_write(file, from, unsigned(std::min(count, kMaxBytes)));
    if (written == 0) errno = ENOSPC;
    if (written <= 0) return false;
    from += written;
    count -= size_t(written);
  }
  return true;
}

}  // namespace

int make_new_file(const std::string& path) {
  return ::_wopen(wide_path(path).c_str(), _O_WRONLY | _O_CREAT | _O_EXCL | _O_BINARY | _O_NOINHERIT,
                  _S_IREAD | _S_IWRITE);
}

// Windows removes no file that is open: its owner closes it first.
void remove_file(const std::string& path) { ::_wunlink(wide_path(path).c_str()); }

ptrdiff_t read_at(int file, uint64_t offset, void* bytes, size_t count) {
  OVERLAPPED place{};
  place.Offset = DWORD(offset);
  place.OffsetHigh = DWORD(offset >> 32);
  DWORD got = 0;
  if (::ReadFile(handle_of(file), bytes, DWORD(std::min(count, size_t(1) << 30)), &got, &place) == 0) {
    return ::GetLastError() == ERROR_HANDLE_EOF ? 0 : -1;
  }
  return ptrdiff_t(got);
}

bool write_parts(int file, const void* first, size_t first_bytes, const void* second, size_t second_bytes) {
  return write_all(file, first, first_bytes) && write_all(file, second, second_bytes);
}

bool cut_file(int file, uint64_t size_bytes) {
  return ::_chsize_s(file, int64_t(size_bytes)) == 0 && ::_lseeki64(file, int64_t(size_bytes), SEEK_SET) >= 0;
}

bool synchronise(int file) { return ::_commit(file) == 0; }

uint64_t next_data(int, uint64_t offset) { return offset; }  // holes read as zeros

std::shared_ptr<const uint8_t> map_file(int file, size_t size_bytes) {
  const HANDLE mapping = ::CreateFileMappingW(handle_of(file), nullptr, PAGE_READONLY, 0, 0, nullptr);
  if (mapping == nullptr) return nullptr;
  const void* const at = ::MapViewOfFile(mapping, FILE_MAP_READ, 0, 0, size_bytes);
  ::CloseHandle(mapping);  // the view keeps it
  if (at == nullptr) return nullptr;
  return {static_cast<const uint8_t*>(at), [](const uint8_t* from) { ::UnmapViewOfFile(from); }};
}

}  // namespace maq
