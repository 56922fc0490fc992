// Files that commands write: their folders, whether they can be written, and JSON.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

// Makes the folder of `path` when it is not there. Throws std::runtime_error.
void make_folder_of(const std::filesystem::path& path);
void make_folder_of(const std::string& path);  // in UTF-8, as all texts that name files

// Before long work: that its result can be written; "" has no result. Makes no folder. Throws std::runtime_error.
void require_writable(const std::string& path);

// JSON in ASCII: other characters are escapes such as \u00e4, and bytes that are no UTF-8, as in names of files,
// \ufffd. `indent` is for each level; -1: one line.
std::string json_text(const nlohmann::ordered_json& document, int indent = -1);

// Writes such a text and a line end, as the SDK writes files: atomically, through links, devices and pipes. "" is not
// written. Makes no folder. Throws std::runtime_error, for example when the disk is full.
void write_json_file(const std::string& path, const nlohmann::ordered_json& document, int indent);

// To a microsecond, which in JSON is a short number.
double rounded_ms(double ms);
