/* The systems that this copy of Maquette has: 1, or 0 if it was built without. Builds without a system install a
 * features.h of their own, and no headers of that system. */
#ifndef MAQUETTE_FEATURES_H_
#define MAQUETTE_FEATURES_H_

#include "maquette/types.h"

#define MAQ_HAS_DENSEPOSE 1
#define MAQ_HAS_SCENES 1
#define MAQ_HAS_EDGES 1
#define MAQ_HAS_HEADS 1
#define MAQ_HAS_PREDICTION 1
#define MAQ_HAS_BODY 1

#endif /* MAQUETTE_FEATURES_H_ */
