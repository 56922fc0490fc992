#include "head/mesh/mesh_files.h"

#include <algorithm>
#include <cmath>
#include <locale>
#include <optional>
#include <sstream>

#include "core/error.h"
#include "core/files/atomic_file.h"
#include "head/mesh/file_axes.h"

namespace maq::head {
namespace {

// Nine digits give a float back to the bit; with a point, whatever the app's locale.
std::ostringstream text_of_floats() {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(9);
  return text;
}

void check_numbers(const std::vector<float>& values, size_t each, const char* what) {
  const auto wrong = std::find_if(values.begin(), values.end(), [](float value) { return !std::isfinite(value); });
  if (wrong == values.end()) return;
  throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The mesh has ", what, " of ", *wrong, " at vertex ",
              size_t(wrong - values.begin()) / each,
              ", which no file can hold. Check the field that it was made from.");
}

void check_joints(const HeadMesh& mesh) {
  bool is_right = mesh.vertex_joints.size() == (mesh.joints.empty() ? 0 : mesh.vertex_count());
  for (size_t i = 0; i < mesh.joints.size(); ++i) {
    const MeshJoint& joint = mesh.joints[i];
    is_right = is_right && joint.parent < int(i) && (joint.parent < 0) == (i == 0) &&
               std::all_of(joint.position.begin(), joint.position.end(), [](float p) { return std::isfinite(p); });
  }
  for (const VertexJoints& vertex : mesh.vertex_joints) {
    for (size_t k = 0; k < 4; ++k) {
      is_right = is_right && vertex.joints[k] < mesh.joints.size() && vertex.weights[k] >= 0 && vertex.weights[k] <= 1;
    }
  }
  if (is_right) return;
  throw Error(
      MAQ_ERROR_INVALID_ARGUMENT,
      "The joints of the mesh are not one tree at finite positions, or do not fit its vertices. Give each vertex "
      "joints that there are, and weights of 0 to 1.");
}

void check_mesh(const HeadMesh& mesh, const std::vector<uint8_t>& texture) {
  const size_t count = mesh.vertex_count();
  if (count == 0 || mesh.triangles.empty()) {
    throw Error(
        MAQ_ERROR_INVALID_ARGUMENT,
        "The mesh has no triangles, so there is nothing to write. Check that its field has a surface in the box.");
  }
  const auto fits = [count](size_t size, size_t each) { return size == 0 || size == count * each; };
  if (mesh.positions.size() % 3 != 0 || mesh.triangles.size() % 3 != 0 || !fits(mesh.normals.size(), 3) ||
      !fits(mesh.colours.size(), 3) || !fits(mesh.template_points.size(), 3) ||
      !fits(mesh.texture_coordinates.size(), 2)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The mesh has ", count,
                " vertices, but one of its arrays has another length. Give each either nothing or a value a vertex.");
  }
  const uint32_t last = *std::max_element(mesh.triangles.begin(), mesh.triangles.end());
  if (last >= count) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A triangle of the mesh has vertex ", last, ", but there are ", count,
                ". Give triangles of vertices that there are.");
  }
  check_numbers(mesh.positions, 3, "a position");
  check_numbers(mesh.normals, 3, "a normal");
  check_numbers(mesh.template_points, 3, "a template point");
  check_numbers(mesh.texture_coordinates, 2, "texture coordinates");
  for (const MorphTarget& target : mesh.morph_targets) {
    if (target.deltas.size() != 3 * target.vertices.size() ||
        std::any_of(target.vertices.begin(), target.vertices.end(), [&](uint32_t v) { return v >= count; })) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The morph target ", target.name,
                  " of the mesh moves vertices that there are not. Give moves of those that there are.");
    }
    check_numbers(target.deltas, 3, "a morph target");
  }
  check_joints(mesh);
  if (texture.empty()) return;
  if (!is_jpeg(texture) && !is_png(texture)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The mesh's texture of ", texture.size(),
                " bytes is neither a JPEG nor a PNG file. Give the bytes of one of these.");
  }
  if (mesh.texture_coordinates.empty()) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT,
                "The mesh has a texture, but no texture coordinates. Give it both or neither.");
  }
}

void write_file(const std::string& path, const void* bytes, size_t count) {
  AtomicFile file(path);
  file.append(bytes, count);
  file.commit();
}

std::string material_as_mtl(const std::string& texture_name) {
  std::string text = "newmtl head\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\n";
  if (!texture_name.empty()) text += "map_Kd " + texture_name + "\n";
  return text;
}

void write_obj(const HeadMesh& mesh, const std::string& path, const std::vector<uint8_t>& texture) {
  const std::string stem = path.substr(0, path.size() - 4);
  const std::string name = stem.substr(stem.rfind('/') + 1);
  if (name.find_first_of("\r\n") != std::string::npos) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT,
                "The name of the .obj has a line break, which its material's name cannot "
                "have. Choose another name.");
  }
  // All bytes are written before the first file gets its name: a full disk leaves all files or none.
  AtomicFile obj_file(path), material_file(stem + ".mtl");
  std::optional<AtomicFile> texture_file;
  std::string texture_name;
  if (!texture.empty()) {
    const std::string extension = is_png(texture) ? ".png" : ".jpg";
    texture_name = name + extension;
    texture_file.emplace(stem + extension).append(texture.data(), texture.size());
  }
  const std::string material = material_as_mtl(texture_name), text = mesh_as_obj(mesh, name + ".mtl");
  material_file.append(material.data(), material.size());
  obj_file.append(text.data(), text.size());
  if (texture_file) texture_file->commit();
  material_file.commit();
  obj_file.commit();
}

template <class T>
void append_bytes(std::string& to, const T* values, size_t count) {
  to.append(reinterpret_cast<const char*>(values), count * sizeof(T));  // every system of the SDK is little endian
}

bool ends_with(const std::string& path, const char* extension) {
  return path.size() > 4 && path.compare(path.size() - 4, 4, extension) == 0;
}

}  // namespace

std::string mesh_as_obj(const HeadMesh& mesh, const std::string& material) {
  const std::vector<float> positions = positions_in_file(mesh), normals = normals_in_file(mesh);
  std::ostringstream text = text_of_floats();
  text << "# metres, y up\nmtllib " << material << "\no head\n";
  for (size_t i = 0; i < positions.size(); i += 3) {
    text << "v " << positions[i] << ' ' << positions[i + 1] << ' ' << positions[i + 2];
    if (!mesh.colours.empty()) {  // an extension that most programs read
      for (size_t axis = 0; axis < 3; ++axis) text << ' ' << double(std::lround(mesh.colours[i + axis] / 0.255)) / 1000;
    }
    text << '\n';
  }
  for (size_t i = 0; i < mesh.texture_coordinates.size(); i += 2) {  // there, v goes up
    text << "vt " << mesh.texture_coordinates[i] << ' ' << 1 - mesh.texture_coordinates[i + 1] << '\n';
  }
  for (size_t i = 0; i < normals.size(); i += 3) {
    text << "vn " << normals[i] << ' ' << normals[i + 1] << ' ' << normals[i + 2] << '\n';
  }
  text << "usemtl head\n";
  const bool has_texture = !mesh.texture_coordinates.empty(), has_normals = !normals.empty();
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    text << 'f';
    for (size_t k = 0; k < 3; ++k) {
      const size_t corner = size_t(mesh.triangles[i + k]) + 1;
      text << ' ' << corner;
      if (has_texture || has_normals) text << '/';
      if (has_texture) text << corner;
      if (has_normals) text << '/' << corner;
    }
    text << '\n';
  }
  return text.str();
}

std::string mesh_as_ply(const HeadMesh& mesh) {
  std::ostringstream header = text_of_floats();
  header << "ply\nformat binary_little_endian 1.0\ncomment metres, y up\nelement vertex " << mesh.vertex_count()
         << '\n';
  const auto add_floats = [&header](std::initializer_list<const char*> names) {
    for (const char* name : names) header << "property float " << name << '\n';
  };
  add_floats({"x", "y", "z"});
  if (!mesh.normals.empty()) add_floats({"nx", "ny", "nz"});
  if (!mesh.colours.empty()) header << "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (!mesh.texture_coordinates.empty()) add_floats({"s", "t"});
  if (!mesh.template_points.empty()) add_floats({"template_x", "template_y", "template_z"});
  header << "element face " << mesh.triangle_count() << "\nproperty list uchar int vertex_indices\nend_header\n";
  std::string text = header.str();
  const std::vector<float> positions = positions_in_file(mesh), normals = normals_in_file(mesh);
  const auto points = to_file_axes(mesh.template_points, [](const float*) { return 0.1; });
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    append_bytes(text, &positions[3 * i], 3);
    if (!normals.empty()) append_bytes(text, &normals[3 * i], 3);
    if (!mesh.colours.empty()) append_bytes(text, &mesh.colours[3 * i], 3);
    if (!mesh.texture_coordinates.empty()) {
      const float up[2] = {mesh.texture_coordinates[2 * i], 1 - mesh.texture_coordinates[2 * i + 1]};
      append_bytes(text, up, 2);
    }
    if (!points.empty()) append_bytes(text, &points[3 * i], 3);
  }
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    text += char(3);
    append_bytes(text, &mesh.triangles[i], 3);
  }
  return text;
}

void write_mesh_file(const HeadMesh& mesh, const std::string& path, const std::vector<uint8_t>& texture) {
  if (!ends_with(path, ".glb") && !ends_with(path, ".obj") && !ends_with(path, ".ply")) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The mesh cannot be written as ", path,
                ": choose a name that ends with .glb, .obj or .ply.");
  }
  check_mesh(mesh, texture);
  if (ends_with(path, ".obj")) return write_obj(mesh, path, texture);
  if (ends_with(path, ".glb")) {
    const std::vector<uint8_t> bytes = mesh_as_glb(mesh, texture);
    return write_file(path, bytes.data(), bytes.size());
  }
  const std::string text = mesh_as_ply(mesh);
  write_file(path, text.data(), text.size());
}

}  // namespace maq::head
