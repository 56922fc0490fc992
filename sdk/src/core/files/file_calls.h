// Calls of the system for open files, which each system has in its own way. A call that a signal interrupts is
// repeated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace maq {

// Makes a file to write to. Returns its descriptor; -1, with errno, where it cannot be made or is there already.
int make_new_file(const std::string& path);
void remove_file(const std::string& path);

// Reads at most `count` bytes from a place in the file. Returns how many; 0 at the end, -1 where it cannot be read.
ptrdiff_t read_at(int file, uint64_t offset, void* bytes, size_t count);

// Writes both parts, one after the other, where the file was written to last. False, with errno, where that fails.
bool write_parts(int file, const void* first, size_t first_bytes, const void* second, size_t second_bytes);

// Cuts the file and continues to write there. False where it cannot be cut.
bool cut_file(int file, uint64_t size_bytes);

// Waits until the file is on the disk. False, with errno, where it is not. File systems that know no such wait have
// done what they can.
bool synchronise(int file);

// The place of the next bytes at `offset` or later that are not in a hole of the file; UINT64_MAX: there are none.
uint64_t next_data(int file, uint64_t offset);

// The bytes of a whole file, to read; null where it cannot be mapped.
std::shared_ptr<const uint8_t> map_file(int file, size_t size_bytes);

}  // namespace maq
