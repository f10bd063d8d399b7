#pragma once

namespace pangea {

// openapi_anchors.json, as the build found it.
extern const char* const kOpenApiText;

}  // namespace pangea
