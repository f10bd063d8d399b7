#pragma once

namespace pangea {

// The text of openapi_anchors.json at build time.
extern const char* const kOpenApiText;

}  // namespace pangea
