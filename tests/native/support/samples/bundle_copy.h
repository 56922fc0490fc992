// A copy of the tiny bundle that a test may damage.
#pragma once

#include <nlohmann/json.hpp>

#include "support/temp_folder.h"

class BundleCopy {
 public:
  BundleCopy() {
    std::filesystem::copy(std::string(MAQ_TEST_DATA) + "/tiny_bundle", folder_.path(),
                          std::filesystem::copy_options::recursive);
  }

  std::string path() const { return folder_.path().string(); }
  std::string file(const std::string& name) const { return folder_.file(name); }

  nlohmann::json manifest() const { return nlohmann::json::parse(read_text(file("manifest.json"))); }
  void write_manifest(const nlohmann::json& manifest) const { write_text(file("manifest.json"), manifest.dump()); }

  // Changes one byte in the middle of a file.
  void flip_byte(const std::string& name) const {
    std::string bytes = read_text(file(name));
    bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
    write_text(file(name), bytes);
  }

 private:
  TempFolder folder_;
};
