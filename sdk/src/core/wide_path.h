// Paths for calls of Windows.
#pragma once

#include <filesystem>
#include <string>

namespace maq {

// The API's paths are UTF-8; the narrow calls of Windows take the code page of the user instead.
inline std::wstring wide_path(const std::string& path) { return std::filesystem::u8path(path).wstring(); }

}  // namespace maq
