// Meshes as files of other programs: metres, x to the person's left, y up, z to the front, like glTF.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "head/mesh/head_mesh.h"

namespace maq::head {

// Writes .glb (glTF 2.0), .obj or .ply (binary, little endian), by the extension of `path` in small letters; the file
// appears atomically. Known arrays are written; template points only to .ply, morph targets and joints only to .glb.
// `texture` is a JPEG or PNG file, empty for none; .ply has none. An .obj gets a material file (.mtl) and a texture
// (.jpg, .png) of the same name; these appear first. Vertex colours of .glb are linear, as glTF requires. They are left
// out with a texture, because they would be multiplied with it. Throws MAQ_ERROR_INVALID_ARGUMENT for another
// extension, an empty mesh, positions or normals that are not finite, arrays of wrong lengths, and a texture of another
// format or without coordinates. Also throws the errors of AtomicFile.
void write_mesh_file(const HeadMesh& mesh, const std::string& path, const std::vector<uint8_t>& texture = {});

// The bytes of each format, for a mesh and texture that write_mesh_file() accepts. `material`: the name of the .mtl.
std::vector<uint8_t> mesh_as_glb(const HeadMesh& mesh, const std::vector<uint8_t>& texture);
std::string mesh_as_obj(const HeadMesh& mesh, const std::string& material);
std::string mesh_as_ply(const HeadMesh& mesh);

}  // namespace maq::head
