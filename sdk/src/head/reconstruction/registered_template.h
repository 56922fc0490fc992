// The surface of a fitted head as the template's mesh: its vertices, triangles and texture coordinates, with joints,
// and facial actions and visemes as morph targets.
#pragma once

#include "core/worker_threads.h"
#include "head/head_template.h"
#include "head/mesh/head_mesh.h"
#include "head/registration/template_registration.h"
#include "head/stored_head.h"

namespace maq::head {

// Like head_surface(): true decimetres, colours, template points; normals are the mesh's. It is open at the neck.
// `registration`: statistics of register_template(). The same for any number of threads.
HeadMesh registered_template(const StoredHead& head, const HeadTemplate& onto, WorkerThreads& threads,
                             TemplateRegistration* registration = nullptr);

}  // namespace maq::head
