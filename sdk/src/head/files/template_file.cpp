#include "head/files/template_file.h"

#include <cmath>

#include "head/files/file_format.h"
#include "head/files/stored_numbers.h"

namespace maq::head {
namespace {

constexpr char kTemplateKind[] = "a template head (.maqt)";
constexpr char kTemplateRemedy[] = "Export the bundle again, or use the Maquette that it was made for.";

// Each times `step`, from the file's numbers.
template <class Stored, class Value>
std::vector<Value> stored_steps(StoredBytes& file, size_t count, Value step) {
  const std::vector<uint8_t> bytes = file.bytes(count * sizeof(Stored));
  std::vector<Value> values(count);
  for (size_t i = 0; i < count; ++i) {
    Stored stored;
    std::memcpy(&stored, bytes.data() + i * sizeof stored, sizeof stored);
    values[i] = Value(stored) * step;
  }
  return values;
}

std::vector<uint32_t> stored_indices(StoredBytes& file, size_t count) {
  return stored_steps<uint16_t, uint32_t>(file, count, 1);
}

bool is_step(float step) { return step >= 1e-6f && step <= 1e-2f; }

}  // namespace

HeadTemplate read_template(const void* bytes, size_t count, const std::string& name) {
  if (count > kMaxTemplateFileBytes) {
    throw Error(MAQ_ERROR_UNSUPPORTED, name, " has ", count, " bytes; a template head has at most ",
                kMaxTemplateFileBytes, ".");
  }
  StoredBytes file(bytes, count, name, MAQ_ERROR_BAD_BUNDLE);
  const auto head =
      file.head<TemplateFileHead>(kTemplateFileMagic, kTemplateFileVersion, kTemplateKind, kTemplateRemedy);
  if (head.points > kMaxTemplatePoints || head.vertices > kMaxTemplatePoints ||
      head.triangles > kMaxTemplateTriangles || head.actions > kMaxActions) {
    file.fail(" claims ", head.points, " points, ", head.vertices, " vertices, ", head.triangles, " triangles and ",
              head.actions, " actions: more than a template may have.");
  }
  if (!is_step(head.point_step_dm) || !is_step(head.move_step_dm)) {
    file.fail(" stores its numbers in steps of ", head.point_step_dm, " and ", head.move_step_dm,
              " dm, but they must be 1e-6 to 0.01.");
  }
  HeadTemplate made;
  made.points = stored_steps<int16_t>(file, 3 * size_t(head.points), head.point_step_dm);
  for (const uint8_t kind : file.bytes(head.points)) made.kinds.push_back(TemplateKind(kind));
  made.vertex_points = stored_indices(file, head.vertices);
  made.texture_coordinates = stored_steps<uint16_t>(file, 2 * size_t(head.vertices), 1.0f);
  for (float& value : made.texture_coordinates) value /= 65535;
  made.triangles = stored_indices(file, 3 * size_t(head.triangles));
  for (uint32_t i = 0; i < head.actions; ++i) {
    FacialAction action;
    const std::vector<uint8_t> text = file.bytes(file.number<uint8_t>());
    action.name.assign(text.begin(), text.end());
    const size_t moved = file.number<uint16_t>();
    action.points = stored_indices(file, moved);
    action.deltas = stored_steps<int16_t>(file, 3 * moved, head.move_step_dm);
    made.actions.push_back(std::move(action));
  }
  file.end();
  if (const std::string fault = template_fault(made); !fault.empty()) {
    file.fail(" cannot be used: ", fault, ". Export the bundle again.");
  }
  return made;
}

}  // namespace maq::head
