// A disk that fails as told, beneath SQLite: a VFS on top of the system's own.
#pragma once

#include <string>

namespace sinerig::test {

// `orders`, by commas:
//   count=FILE   at the end of the process, "OPERATIONS BYTES" into FILE: writes, syncs,
//   truncations
//                and removals so far, and bytes by which files have grown
//   kill=N       kill -9 of this process at its N-th operation
//   power        what has not been synced is not on the disk; of a sync that the kill hits, a part
//   is full=N       files may grow by N bytes, then the disk is full, after a short write; the room
//                that a run holds back (NAME-spare) counts once it is given back
//   fails=N      from its N-th operation on the disk takes no write: it has become read-only
//   slow=MS      every sync takes this long
//   hold=FILE    no sync returns while there is such a file
// Becomes the default VFS. Throws std::invalid_argument for anything else.
void install_faulty_disk(const std::string& orders);

}  // namespace sinerig::test
