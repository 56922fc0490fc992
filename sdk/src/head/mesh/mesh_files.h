// Meshes as files of other programs: metres, x to the person's left, y up, z to the front, as glTF has it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "head/mesh/head_mesh.h"

namespace maq::head {

// Writes .glb (glTF 2.0), .obj or .ply (binary, little endian), by the extension of `path` in small letters; it appears
// atomically. What the mesh knows is written, template points in .ply alone, morph targets in .glb alone. `texture` is
// a JPEG or PNG file, empty for none; .ply has none. An .obj gets a material beside it, named like it but .mtl, and its
// texture likewise (.jpg, .png); these appear first. Vertex colours of .glb are linear, as glTF wants them, and left
// out where there is a texture, which they would be multiplied with. Throws MAQ_ERROR_INVALID_ARGUMENT for another
// extension, an empty mesh, positions or normals that are no numbers, arrays of wrong lengths, a texture of another
// format or without coordinates; and what AtomicFile throws.
void write_mesh_file(const HeadMesh& mesh, const std::string& path, const std::vector<uint8_t>& texture = {});

// What each has written in it, of a mesh and texture that write_mesh_file() would take. `material`: the name of the
// .mtl.
std::vector<uint8_t> mesh_as_glb(const HeadMesh& mesh, const std::vector<uint8_t>& texture);
std::string mesh_as_obj(const HeadMesh& mesh, const std::string& material);
std::string mesh_as_ply(const HeadMesh& mesh);

}  // namespace maq::head
