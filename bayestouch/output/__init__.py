"""Output that diagnosis and reports share: pictures, numbers as text, folders of files."""
