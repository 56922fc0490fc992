#pragma once

namespace maq {

// Whether an image is turned by its EXIF orientation or left as it lies in the file.
enum class Orientation { kUpright, kAsStored };

}  // namespace maq
