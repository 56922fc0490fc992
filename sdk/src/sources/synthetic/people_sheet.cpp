#include "sources/synthetic/people_sheet.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "core/files/file.h"
#include "core/module.h"
#include "image/files/jpeg.h"

namespace maq {
namespace {

constexpr uint64_t kMaxSheetBytes = 16 << 20;

// Alpha in quarters, each given its neighbours, by adaptive binary arithmetic coding (Witten, Neal and Cleary 1987,
// "Arithmetic coding for data compression"). export/people/sprite_files.py does the same steps.
class MaskReader {
 public:
  explicit MaskReader(const std::vector<uint8_t>& file) : file_(file) {
    probabilities_.fill(1u << 15);
    for (int i = 0; i < 4; ++i) shift_in();
  }

  // `row` and `above` have a 0 before and after their `width` values.
  void read_row(const uint8_t* above, int width, uint8_t* row) {
    static constexpr uint8_t kKind[] = {0, 1, 1, 1, 2};  // kind of a value: nothing, a part, all
    for (int x = 1; x <= width; ++x) {
      const int context = ((row[x - 1] * 5 + above[x]) * 3 + kKind[above[x - 1]]) * 3 + kKind[above[x + 1]];
      row[x] = read_value(&probabilities_[size_t(context) * 4]);
    }
  }

  bool is_used_up() const { return position_ == file_.size(); }

 private:
  uint8_t read_value(uint16_t* probabilities) {
    if (is_yes(probabilities[0])) return 0;
    if (is_yes(probabilities[1])) return 4;
    if (is_yes(probabilities[2])) return 1;
    return is_yes(probabilities[3]) ? 2 : 3;
  }

  // `probability` of a yes, of 65536; moves 1/32 of the way to the decoded bit.
  bool is_yes(uint16_t& probability) {
    const uint32_t middle = low_ + uint32_t(uint64_t(high_ - low_) * probability >> 16);
    const bool yes = value_ <= middle;
    if (yes) {
      high_ = middle;
      probability = uint16_t(probability + ((65536 - probability) >> 5));
    } else {
      low_ = middle + 1;
      probability = uint16_t(probability - (probability >> 5));
    }
    while ((low_ ^ high_) >> 24 == 0) shift_in();
    return yes;
  }

  // After the end, zeros.
  void shift_in() {
    low_ <<= 8;
    high_ = high_ << 8 | 0xff;
    value_ = value_ << 8 | (position_ < file_.size() ? file_[position_] : 0);
    ++position_;
  }

  const std::vector<uint8_t>& file_;
  size_t position_ = 0;
  uint32_t low_ = 0, high_ = 0xffffffff, value_ = 0;
  std::array<uint16_t, 5 * 5 * 3 * 3 * 4> probabilities_;
};

}  // namespace

BgraImage decode_people_sheet(const std::vector<uint8_t>& colours, const std::vector<uint8_t>& mask) {
  Frame decoded;
  if (!JpegDecoder().decode(colours.data(), colours.size(), MAQ_MAX_PIXELS, decoded)) {
    throw Error(MAQ_ERROR_UNREADABLE, "The colours of stub:people, ", colours.size(),
                " bytes, are not a complete JPEG image; install the file share/maquette/stub/people.jpg again.");
  }
  const int width = decoded.image.width_px, height = decoded.image.height_px;
  BgraImage sheet{width, height, std::vector<uint8_t>(size_t(width) * size_t(height) * 4)};
  MaskReader reader(mask);
  std::vector<uint8_t> above(size_t(width) + 2), row(above);
  const uint8_t* bgr = decoded.storage.data();
  uint8_t* pixel = sheet.pixels.data();
  for (int y = 0; y < height; ++y) {
    reader.read_row(above.data(), width, row.data());
    for (int x = 1; x <= width; ++x, bgr += 3, pixel += 4) {
      std::copy(bgr, bgr + 3, pixel);
      pixel[3] = uint8_t((row[size_t(x)] * 255 + 2) / 4);
    }
    std::swap(above, row);
  }
  if (!reader.is_used_up()) {
    throw Error(MAQ_ERROR_UNREADABLE, "The mask of stub:people, ", mask.size(),
                " bytes, does not fit its colours; install both files of share/maquette/stub again.");
  }
  return sheet;
}

BgraImage read_people_sheet() {
  const std::string colours = find_shared_file("stub/people.jpg"), mask = find_shared_file("stub/people.mask");
  if (colours.empty() || mask.empty()) {
    throw Error(MAQ_ERROR_NOT_FOUND,
                "stub:people needs share/maquette/stub/people.jpg and people.mask beside the library's ", "folder ",
                library_folder(), "; install them, or use stub:pattern.");
  }
  return decode_people_sheet(read_file(colours, kMaxSheetBytes), read_file(mask, kMaxSheetBytes));
}

}  // namespace maq
