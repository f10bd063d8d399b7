#pragma once

// Messages about anchors to domain types and back. As in messages.h, after Parse every field is
// within bounds.

#include "core/anchor.h"
#include "messages/messages.h"
#include "pangea/anchor_edit_t.hpp"
#include "pangea/anchor_t.hpp"
#include "pangea/shown_anchors_t.hpp"

namespace pangea {

anchor_id_t ToMessage(const AnchorId& id);
anchor_edit_t ToMessage(const AnchorEdit& edit);
anchor_t ToMessage(const AnchorState& state);
shown_anchors_t ToMessage(const ShownAnchors& shown);

Parsed<AnchorId> Parse(const anchor_id_t& message);
Parsed<AnchorEdit> Parse(const anchor_edit_t& message);
Parsed<AnchorState> Parse(const anchor_t& message);
Parsed<ShownAnchors> Parse(const shown_anchors_t& message);

}  // namespace pangea
