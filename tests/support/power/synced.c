/* What a disk has after a power cut: the names and contents that were synced, and no others.

Loaded with LD_PRELOAD. Files are written as ever; beside that, what is synced below the folder $POWER_LIVE is copied to
the folder $POWER_DISK before the call returns: of a file its content, under the file's identity; of a folder its entries,
one a line, as `identity type name`. An identity is the inode with the time of its birth, since inodes are used again. A
sync of a file does not keep its name; that takes a sync of the folder, as POSIX has it. The real disk is spared. */

#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static void fail(const char *what)
{
    fprintf(stderr, "power: %s: %s\n", what, strerror(errno));
    abort();
}

static void identity(int folder, const char *name, int flags, char *out, unsigned short *mode)
{
    struct statx found;
    if (statx(folder, name, flags, STATX_INO | STATX_BTIME | STATX_TYPE, &found) != 0) {
        *out = 0; /* it is gone meanwhile */
        return;
    }
    sprintf(out, "%llu-%lld.%u", (unsigned long long)found.stx_ino, (long long)found.stx_btime.tv_sec,
            found.stx_btime.tv_nsec);
    *mode = found.stx_mode;
}

static void write_all(int to, const char *data, ssize_t size)
{
    while (size > 0) {
        ssize_t done = write(to, data, size);
        if (done < 0)
            fail("write");
        data += done;
        size -= done;
    }
}

static void copy_content(const char *source, int to)
{
    char data[1 << 16];
    int from = open(source, O_RDONLY | O_CLOEXEC);
    if (from < 0)
        fail(source);
    for (ssize_t size; (size = read(from, data, sizeof data)) != 0;) {
        if (size < 0)
            fail("read");
        write_all(to, data, size);
    }
    close(from);
}

static void list_entries(const char *path, int to)
{
    DIR *folder = opendir(path);
    if (folder == NULL)
        fail(path);
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        char line[128 + NAME_MAX], key[64];
        unsigned short mode;
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        identity(dirfd(folder), entry->d_name, AT_SYMLINK_NOFOLLOW, key, &mode);
        if (*key == 0)
            continue;
        sprintf(line, "%s %c %s\n", key, S_ISDIR(mode) ? 'd' : 'f', entry->d_name);
        write_all(to, line, strlen(line));
    }
    closedir(folder);
}

/* Whether it is below the folder, and kept therefore. */
static int keep(int descriptor)
{
    const char *live = getenv("POWER_LIVE"), *disk = getenv("POWER_DISK");
    char link[64], path[PATH_MAX], key[64], part[PATH_MAX], place[PATH_MAX];
    unsigned short mode;
    sprintf(link, "/proc/self/fd/%d", descriptor);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (live == NULL || disk == NULL || length < 0)
        return 0;
    path[length] = 0;
    if (strncmp(path, live, strlen(live)) != 0 || (path[strlen(live)] != '/' && path[strlen(live)] != 0))
        return 0;
    identity(descriptor, "", AT_EMPTY_PATH, key, &mode);
    /* One at a time: a sync that began earlier must not replace what a later one has kept. */
    snprintf(place, sizeof place, "%s/.lock", disk);
    int lock = open(place, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock < 0 || flock(lock, LOCK_EX) != 0)
        fail(place);
    snprintf(place, sizeof place, "%s/%s", disk, key);
    snprintf(part, sizeof part, "%s/.part", disk);
    int to = open(part, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (to < 0)
        fail(part);
    if (S_ISDIR(mode))
        list_entries(link, to);
    else
        copy_content(link, to);
    close(to);
    if (rename(part, place) != 0)
        fail(place);
    close(lock);
    return 1;
}

static int synced(const char *call, int descriptor)
{
    if (keep(descriptor))
        return 0;
    int (*real)(int) = (int (*)(int))dlsym(RTLD_NEXT, call);
    return real(descriptor);
}

int fsync(int descriptor)
{
    return synced("fsync", descriptor);
}

int fdatasync(int descriptor)
{
    return synced("fdatasync", descriptor);
}
