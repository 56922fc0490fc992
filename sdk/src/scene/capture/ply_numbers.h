// The numbers behind the head of a PLY file.
#pragma once

#include "scene/capture/ply_header.h"

namespace maq {

// Reads one number after the other. Throws MAQ_ERROR_UNREADABLE where the file ends before, or a word is no number.
class PlyNumbers {
 public:
  PlyNumbers(FileReader& file, PlyForm form);

  double next(PlyType type);
  // Skips a property of one element, a list included.
  void skip(const PlyProperty& property);

 private:
  double next_of_text();

  FileReader& file_;
  bool is_text_;
  ByteOrder order_;
};

// Throws MAQ_ERROR_UNREADABLE if the rest of the file is shorter than the element claims.
void check_ply_count(const PlyElement& element, PlyForm form, const FileReader& file);

// Skips all of an element.
void skip_ply_element(const PlyElement& element, PlyForm form, PlyNumbers& numbers, FileReader& file);

}  // namespace maq
