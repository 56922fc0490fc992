#include "output/output_file.h"

#include <cmath>
#include <stdexcept>

#include "core/files/atomic_file.h"
#include "print.h"

namespace fs = std::filesystem;

void make_folder_of(const fs::path& path) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  if (error) throw std::runtime_error(path.string() + " cannot be written: " + error.message() + ".");
}

void make_folder_of(const std::string& path) { make_folder_of(fs::u8path(path)); }

void require_writable(const std::string& path) {
  if (path.empty()) return;
  std::error_code error;
  if (fs::is_directory(fs::u8path(path), error)) throw std::runtime_error(path + " is a folder; name a file in it.");
  const maq::AtomicFile probe(path);
}

std::string json_text(const nlohmann::ordered_json& document, int indent) {
  return document.dump(indent, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

void write_json_file(const std::string& path, const nlohmann::ordered_json& document, int indent) {
  if (path.empty()) return;
  const std::string text = json_text(document, indent) + "\n";
  flush_output();  // where the file may lead to
  maq::AtomicFile file(path);
  file.append(text.data(), text.size());
  file.commit();
}

double rounded_ms(double ms) { return std::round(1e3 * ms) / 1e3; }
