#include "scene/capture/ply_numbers.h"

#include <algorithm>
#include <cmath>

namespace maq {

PlyNumbers::PlyNumbers(FileReader& file, PlyForm form)
    : file_(file),
      is_text_(form == PlyForm::kAscii),
      order_(form == PlyForm::kBigEndian ? ByteOrder::kBig : ByteOrder::kLittle) {}

double PlyNumbers::next(PlyType type) {
  if (is_text_) return next_of_text();
  switch (type) {
    case PlyType::kInt8: return file_.number<int8_t>(order_);
    case PlyType::kUint8: return file_.number<uint8_t>(order_);
    case PlyType::kInt16: return file_.number<int16_t>(order_);
    case PlyType::kUint16: return file_.number<uint16_t>(order_);
    case PlyType::kInt32: return file_.number<int32_t>(order_);
    case PlyType::kUint32: return file_.number<uint32_t>(order_);
    case PlyType::kFloat32: return double(file_.number<float>(order_));
    case PlyType::kFloat64: return file_.number<double>(order_);
  }
  return 0;
}

void PlyNumbers::skip(const PlyProperty& property) {
  if (!property.is_list) {
    next(property.type);
    return;
  }
  const double length = next(property.count_type);
  const uint64_t min_bytes = is_text_ ? 2 : size_bytes(property.type);
  // In text the file's last number needs no space behind it.
  if (!(length >= 0) || length != std::floor(length) || length > double(file_.remaining() + 1) / double(min_bytes)) {
    file_.fail(" has a list \"", printable(property.name), "\" of length ", length, ", but only ", file_.remaining(),
               " bytes behind it: it is truncated or damaged.");
  }
  if (is_text_) {
    for (uint64_t i = 0; i < uint64_t(length); ++i) next(property.type);
  } else {
    file_.skip(uint64_t(length) * min_bytes);
  }
}

double PlyNumbers::next_of_text() {
  const std::string_view word = file_.next_word();
  if (word.empty()) file_.fail(" ends early: it is truncated or damaged; copy it again.");
  double number = 0;
  if (!parse_number(word, number)) {
    file_.fail(", line ", file_.line(), ": \"", printable(word), "\" is not a number.");
  }
  return number;
}

void check_ply_count(const PlyElement& element, PlyForm form, const FileReader& file) {
  const uint64_t min_bytes = element.min_bytes(form);
  if (min_bytes == 0) return;
  const uint64_t max_count = (file.remaining() + 1) / min_bytes;
  if (element.count > max_count) {
    file.fail(" claims ", element.count, " of \"", printable(element.name), "\", but has bytes for ", max_count,
              " at most: it is truncated or damaged; copy it again.");
  }
}

void skip_ply_element(const PlyElement& element, PlyForm form, PlyNumbers& numbers, FileReader& file) {
  check_ply_count(element, form, file);
  const bool has_list = std::any_of(element.properties.begin(), element.properties.end(),
                                    [](const PlyProperty& property) { return property.is_list; });
  if (form != PlyForm::kAscii && !has_list) {
    file.skip(element.count * element.min_bytes(form));
    return;
  }
  if (element.properties.empty()) return;
  for (uint64_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) numbers.skip(property);
  }
}

}  // namespace maq
