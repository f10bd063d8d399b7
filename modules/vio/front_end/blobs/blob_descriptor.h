#pragma once

// Binary descriptor of a blob: SIFT's histogram of gradients (Lowe, IJCV 2004, sections 5 and 6) in
// 256 bits. The bits are signs of random projections, which preserve angles between vectors
// (Charikar, STOC 2002). Two rounds of random signs and a Hadamard transform give 128 bits, and two
// other rounds the other 128 (Ailon and Chazelle, STOC 2006).

#include <span>
#include <vector>

#include "core/keyframe.h"
#include "vio/front_end/blobs/scale_space.h"

namespace pangea::vio {

// One descriptor per dominant gradient orientation: the strongest, and others about as strong.
std::vector<Descriptor> DescribeBlob(const ScaleSpace& space, const Blob& blob);

// `histogram` has 128 bins.
Descriptor SignsOfProjections(std::span<const float> histogram);

}  // namespace pangea::vio
