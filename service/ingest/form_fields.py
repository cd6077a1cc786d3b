"""The parts of a multipart form: files, and the text fields that a request knows."""

from collections import Counter
from collections.abc import Collection, Iterator, Sequence

from service.ingest.uploads import Upload
from service.problems import invalid_input, unknown_name
from underskin.errors import InvalidInput, not_unique, wrong_type

FILE = "file"  # a part of this name is a file, also where its sender gives no file name
_LONGEST_TEXT = 4096  # bytes


def split(
    uploads: Sequence[Upload], texts: Collection[str] = (), single_files: Collection[str] = ()
) -> tuple[dict[str, str], list[Upload]]:
    """The values of the text fields `texts`, and all other parts, which are files; a body that is not a form is one
    file.

    A part with a file name is a file, whatever its field name; a field of `single_files` may come once. Raises Refusal
    (422) naming each field that is unknown, given twice, or a file in place of a text.
    """
    form = [upload for upload in uploads if upload.in_form]
    errors = [error for upload in form for error in _errors(upload, texts, single_files)]
    count = Counter(upload.field for upload in form)
    once = (*texts, *single_files)
    errors += [not_unique(name, f"{count[name]} parts") for name in once if count[name] > 1]
    if errors:
        raise invalid_input(errors)
    values = {str(upload.field): upload.path.read_bytes().decode() for upload in form if upload.field in texts}
    return values, [upload for upload in uploads if upload.field not in texts]


def _errors(upload: Upload, texts: Collection[str], single_files: Collection[str]) -> Iterator[InvalidInput]:
    """Errors of one part of a form."""
    name = upload.field or ""
    names = (*texts, FILE, *single_files)
    if upload.label is None and name not in names:
        yield unknown_name(name, _start(upload), names, "form field")
    elif name in texts and upload.label is not None:
        yield wrong_type(name, upload.label, "must be a text, not a file")
    elif name in texts and not _is_short_text(upload):
        yield wrong_type(name, _start(upload), f"must be text in UTF-8 of at most {_LONGEST_TEXT} bytes")


def _is_short_text(upload: Upload) -> bool:
    if upload.path.stat().st_size > _LONGEST_TEXT:
        return False
    try:
        upload.path.read_bytes().decode()
    except UnicodeDecodeError:
        return False
    return True


def _start(upload: Upload) -> str:
    """The start of a text, as long as an error message shows."""
    return upload.start(100).decode("utf-8", "replace")
